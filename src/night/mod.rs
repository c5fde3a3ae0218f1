//! Where the halves meet: the pipeline, the comparison, the simulation.
