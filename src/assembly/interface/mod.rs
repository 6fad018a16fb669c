//! What deformable contacts of a rank share: fields of foreign nodes, couplings, and rows sent to other ranks.

mod couplings;
mod numbering;
