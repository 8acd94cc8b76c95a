"""The worst motion of a response curve: the highest that can persist, stable or found by time integration."""
