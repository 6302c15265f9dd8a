//! Lists of threads folded into short rows of workgroups, as long ones are: every pass finds its place.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene, solve, winners};
use crate::glossy::glossy;
use linklight::gpu::Options;
use linklight::methods::implicit_visibility::Settings;

#[test]
fn folded_lists_change_no_bit() {
    // Glossy, so that directions are pulled up too.
    let mut scene = builtin_scene("cornell-box");
    scene.materials[0].metallic = 1.0;
    scene.materials[0].roughness = 0.3;
    let settings = Settings { bins: 3, glossy_bins: 2, ..Settings::default() };
    let solved = |row: Option<u32>| {
        let context = TestContext::with(Options { max_row_of_workgroups: row, ..Options::default() });
        let fixture = glossy(&context, Fixture::new(&context, scene.clone(), Some(0.6)));
        let method = fixture.linked(&context, settings);
        let (leaves, glossy) = (method.trees().topology.leaf_count(), method.report().glossy);
        assert!(leaves > 256 && glossy > 64, "{leaves} leaves, {glossy} of them glossy");
        (winners(&context, &method), solve(&context, &method, &fixture.world, 2))
    };
    let (plain, folded) = (solved(None), solved(Some(2)));
    assert!(plain.0 == folded.0, "other winners");
    assert!(plain.1 == folded.1, "other light");
    assert!(plain.1.indirect.iter().any(|light| light.max_element() > 0.0));
}
