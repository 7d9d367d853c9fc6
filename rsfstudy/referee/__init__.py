"""Checks of other codes: problems of a spring-slider with known answers, and verdicts on theirs."""
