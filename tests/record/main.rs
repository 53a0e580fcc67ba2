//! Tests bags without DDS: our reader and others read the written bags, and no bytes crash our reader.

mod bags;
mod damage;
mod figures;
mod fuzz;
mod hostile;
mod interop;
mod memory;
mod partial;
mod points;
mod reading;
mod records;
mod runs;
mod writing;

use memory::measured;
