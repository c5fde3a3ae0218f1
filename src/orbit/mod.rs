//! From elements to where the satellite, the Sun and the Moon stand.
