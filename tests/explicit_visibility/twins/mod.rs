//! Plain twins of the passes: slices in binding order, statements in the shader's order.

pub mod elements;
pub mod light;
pub mod links;
