"""The physics of a spring-slider: floats in, floats out. It can be read alone."""
