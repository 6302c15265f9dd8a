//! Under GPU-assisted validation, which looks at every access of a shader: none reaches beyond what is bound to it.
//!
//! Instrumented shaders take long to compile: the tests take one method, `LINKLIGHT_ASSISTED=all` every one.

use super::tests::pixels;
use super::*;
use crate::gpu::Options;
use crate::methods::METHODS;

#[test]
fn shaders_stay_within_what_is_bound() {
    let all = std::env::var("LINKLIGHT_ASSISTED").is_ok_and(|text| text == "all");
    for method in METHODS.iter().filter(|method| all || method.key == "explicit-visibility") {
        let options = Options { validation: true, gpu_assisted: true, ..Options::default() };
        let context = Context::new(options).unwrap();
        let mut engine = Engine::new(&context);
        let settings = super::soak_tests::small_settings(method.key);
        let picture = format!("builtin:cornell-box --method {} {settings} --size 16x12", method.key);
        let start = std::time::Instant::now();
        pixels(&context, &mut engine, &picture);
        // The layer says first what it switches on for itself.
        let mut said = context.validation_messages();
        said.retain(|m| !m.contains("layer settings provided") && !m.contains("validation is adjusting settings"));
        println!("{}: {:.0?}, {} messages", method.key, start.elapsed(), said.len());
        assert!(said.is_empty(), "{}: {}", method.key, said.join("\n"));
    }
}
