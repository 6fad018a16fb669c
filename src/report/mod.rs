//! A page about results.
