//! Tests bags without DDS: written bags are read by us and by others, and no bytes crash the reader.

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
