"""nonlinear"""
