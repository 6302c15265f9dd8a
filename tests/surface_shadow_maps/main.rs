//! Surface shadow maps: compressed maps against uncompressed ones, the cache, the solution on the atlas.

mod checked;
#[path = "../common/mod.rs"]
mod common;
mod fixture;
mod glossy;
mod hidden;
mod kernels;
mod look_ups;
mod maps;
mod moving;
mod outside;
mod shiny;
mod solve;
#[path = "../final_gather/twins.rs"]
mod twins;
