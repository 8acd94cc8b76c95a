"""The study `flutter`: limit cycles of the waves that the flow feeds."""
