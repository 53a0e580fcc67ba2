//! Tests of the cycle in fake time.
