//! Bags, without DDS: what is written is what is read, by us and by others; and no bytes bring the reader down.

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
