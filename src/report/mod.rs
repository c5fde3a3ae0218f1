//! Tables and plots, drawn from results alone.
