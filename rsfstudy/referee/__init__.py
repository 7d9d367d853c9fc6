"""The referee: problems of a spring-slider with answers, against which any code can be checked."""
