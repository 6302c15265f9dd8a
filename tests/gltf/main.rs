//! The glTF loader: valid files hold what they should, bad ones end in clean errors.

mod bad;
mod conformance;
mod features;
mod mutated;
mod rules;
mod shared_bad;
mod sound;
mod support;
