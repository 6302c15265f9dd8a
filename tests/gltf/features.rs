//! Each feature of the format, read from a small file of its own, gives the values it should.

use crate::sound::assert_sound;
use crate::support::{Builder, everything, png, shared, triangle};
use glam::{Mat4, Quat, Vec2, Vec3, Vec4};
use linklight::scene::{self, Interpolation, LightKind, LoadOptions, Projection, Scene, SceneChoice, Track, Transform};
use serde_json::{Value, json};

#[track_caller]
fn load(builder: &Builder) -> Scene {
    let scene = scene::load_bytes("test.glb", &builder.glb()).unwrap_or_else(|error| panic!("{error}"));
    assert_sound(&scene, "test.glb");
    scene
}

#[track_caller]
fn primitive(builder: &Builder) -> scene::Primitive {
    load(builder).meshes.swap_remove(0).primitives.swap_remove(0)
}

fn attribute(builder: &mut Builder, name: &str, accessor: usize) {
    builder.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
}

fn normalized(builder: &mut Builder, accessor: usize) -> usize {
    builder.json["accessors"][accessor]["normalized"] = json!(true);
    accessor
}

#[test]
fn vertex_colours_of_every_type_are_read() {
    let rgb = [Vec4::new(1.0, 0.0, 0.2, 1.0), Vec4::new(0.0, 1.0, 0.4, 1.0), Vec4::new(0.6, 0.8, 1.0, 1.0)];
    let rgba = [rgb[0].with_w(0.0), rgb[1].with_w(0.2), rgb[2]];
    for (kind, expected, components) in [("VEC3", rgb, 3), ("VEC4", rgba, 4)] {
        let values: Vec<f32> = expected.iter().flat_map(|color| color.to_array()[..components].to_vec()).collect();
        let u8s: Vec<u8> = values.iter().map(|value| (value * 255.0) as u8).collect();
        let u16s: Vec<u16> = values.iter().map(|value| (value * 65535.0) as u16).collect();
        for component in [5126, 5121, 5123] {
            let mut builder = triangle();
            let accessor = match component {
                5126 => builder.floats(kind, &values),
                5121 => builder.u8s(kind, &u8s),
                _ => builder.u16s(kind, &u16s),
            };
            builder.json["accessors"][accessor]["normalized"] = json!(component != 5126);
            attribute(&mut builder, "COLOR_0", accessor);
            assert_eq!(primitive(&builder).colors, expected, "{kind} {component}");
        }
    }
}

#[test]
fn normalised_integers_span_their_range() {
    let mut builder = triangle();
    let uv = builder.u8s("VEC2", &[0, 255, 51, 102, 204, 0]);
    let uv = normalized(&mut builder, uv);
    attribute(&mut builder, "TEXCOORD_0", uv);
    let signed: Vec<u8> = [-32768i16, -32767, 0, 32767, 16384, -1].iter().flat_map(|v| v.to_le_bytes()).collect();
    let uv = builder.accessor("VEC2", 5122, &signed, 2);
    let uv = normalized(&mut builder, uv);
    attribute(&mut builder, "TEXCOORD_1", uv);
    let primitive = primitive(&builder);
    assert_eq!(primitive.uv[0], [Vec2::new(0.0, 1.0), Vec2::new(0.2, 0.4), Vec2::new(0.8, 0.0)]);
    // The smallest signed value is clamped: -1 is met twice.
    let expected = [Vec2::new(-1.0, -1.0), Vec2::new(0.0, 1.0), Vec2::new(16384.0 / 32767.0, -1.0 / 32767.0)];
    assert_eq!(primitive.uv[1], expected);
}

#[test]
fn quantised_positions_are_read_plain_or_normalised() {
    let bytes: Vec<u8> = [0i8, 0, 0, 0, 100, 0, 0, 0, 0, -127, 0, 0].map(|value| value as u8).to_vec();
    for (is_normalized, scale) in [(false, 1.0), (true, 1.0 / 127.0)] {
        let mut builder = triangle();
        builder.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let view = builder.view(&bytes);
        builder.json["bufferViews"][view]["byteStride"] = json!(4);
        builder.json["accessors"][0] = json!({ "bufferView": view, "componentType": 5120, "type": "VEC3", "count": 3, "normalized": is_normalized });
        let expected = [Vec3::ZERO, Vec3::X * (100.0 * scale), Vec3::Y * (-127.0 * scale)];
        let positions = primitive(&builder).positions;
        assert!(positions.iter().zip(expected).all(|(a, b)| a.abs_diff_eq(b, 1e-6)), "{positions:?}");
    }
}

#[test]
fn sparse_values_replace_those_of_the_base_or_zero() {
    for has_base in [true, false] {
        let mut builder = triangle();
        let (indices, values) = (builder.view(&[1, 0, 2, 0]), builder.view(&floats(&[5.0, 0.0, 0.0, 0.0, 7.0, 1.0])));
        builder.json["accessors"][0]["sparse"] = json!({
            "count": 2,
            "indices": { "bufferView": indices, "componentType": 5123 },
            "values": { "bufferView": values },
        });
        let positions = builder.json["accessors"][0].as_object_mut().unwrap();
        if !has_base {
            positions.remove("bufferView");
        }
        let expected = [Vec3::ZERO, Vec3::new(5.0, 0.0, 0.0), Vec3::new(0.0, 7.0, 1.0)];
        assert_eq!(primitive(&builder).positions, expected);
    }
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

#[test]
fn only_the_vertices_in_use_are_kept_and_shared() {
    let mut builder = triangle();
    let corners = [[0.0, 0.0], [9.0, 9.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let positions: Vec<f32> = corners.iter().flat_map(|[x, y]| [*x, *y, 0.0]).collect();
    let position = builder.floats("VEC3", &positions);
    let indices = builder.accessor("SCALAR", 5125, &[0u32, 2, 3, 0, 3, 4].map(u32::to_le_bytes).concat(), 4);
    builder.json["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": position }, "indices": indices });
    let square = primitive(&builder);
    // Coplanar triangles keep sharing their vertices although the file has no normals.
    assert_eq!((square.positions.len(), square.triangles.len()), (4, 2));
    assert!(square.normals.iter().all(|normal| *normal == Vec3::Z));
}

#[test]
fn missing_normals_are_flat_and_hard_edges_are_doubled() {
    let mut builder = triangle();
    // A roof: two triangles on a common edge, at right angles.
    let position = builder.floats("VEC3", &[0., 0., 0., 0., 0., 1., 1., 0., 0., 0., 1., 0.]);
    let indices = builder.u8s("SCALAR", &[0, 1, 2, 0, 3, 1]);
    let moved = builder.floats("VEC3", &[0., 0., 0., 0., 0., 0., 0., 0., 0., 1., 0., 0.]);
    let roof =
        json!({ "attributes": { "POSITION": position }, "indices": indices, "targets": [{ "POSITION": moved }] });
    builder.json["meshes"][0]["primitives"][0] = roof;
    let roof = primitive(&builder);
    assert_eq!(roof.positions.len(), 6);
    for (triangle, normal) in roof.triangles.iter().zip([Vec3::Y, Vec3::X]) {
        triangle.iter().for_each(|vertex| assert_eq!(roof.normals[*vertex as usize], normal));
    }
    // The target tilts the second triangle by 45 degrees; its normal follows.
    let tilted = roof.triangles[1].map(|v| roof.normals[v as usize] + roof.morph_targets[0].normals[v as usize]);
    assert!(tilted.iter().all(|normal| normal.abs_diff_eq(Vec3::new(1.0, -1.0, 0.0).normalize(), 1e-6)), "{tilted:?}");
}

#[test]
fn two_sets_of_joints_make_eight_influences() {
    let mut builder = triangle();
    for (set, joints) in [("0", [0, 1, 2, 3]), ("1", [4, 5, 6, 7])] {
        let joints = builder.u16s("VEC4", &joints.repeat(3));
        attribute(&mut builder, &format!("JOINTS_{set}"), joints);
        let weights = builder.u8s("VEC4", &[255; 12]);
        let weights = normalized(&mut builder, weights);
        attribute(&mut builder, &format!("WEIGHTS_{set}"), weights);
    }
    let primitive = primitive(&builder);
    assert_eq!(primitive.joints, [[0, 1, 2, 3, 4, 5, 6, 7]; 3]);
    assert_eq!(primitive.joint_weights, [[0.125; 8]; 3]);
}

#[test]
fn joints_outside_the_scene_come_with_their_ancestors() {
    let mut builder = everything();
    // The joints 2 and 3 hang below node 8, of another scene.
    builder.push("nodes", json!({ "children": [2], "translation": [5, 0, 0], "mesh": 1 }));
    builder.json["scenes"] = json!([{ "nodes": [0] }, { "nodes": [8] }]);
    let scene = load(&builder);
    let joint = &scene.nodes[scene.skins[0].joints[0] as usize];
    let ancestor = &scene.nodes[joint.parent.unwrap() as usize];
    assert!(matches!(ancestor.transform, Transform::Trs { translation, .. } if translation.x == 5.0));
    assert_eq!(ancestor.mesh, None, "what moves a joint of another scene is not shown");
}

#[test]
fn scenes_are_chosen_by_index_or_name() {
    let mut builder = triangle();
    builder.push("nodes", json!({ "name": "second" }));
    builder.json["scenes"] = json!([{ "name": "a", "nodes": [0] }, { "name": "b", "nodes": [1] }]);
    let load = |builder: &Builder, scene: Option<SceneChoice>| {
        let options = LoadOptions { scene, ..LoadOptions::default() };
        scene::load_bytes_with("test.glb", &builder.glb(), &options)
    };
    assert_eq!(load(&builder, None).unwrap().name, "a");
    assert_eq!(load(&builder, "1".parse().ok()).unwrap().nodes[0].name, "second");
    assert_eq!(load(&builder, "b".parse().ok()).unwrap().name, "b");
    let error = load(&builder, "c".parse().ok()).unwrap_err().to_string();
    assert!(error.contains("no scene \"c\"; the file has 2: \"a\", \"b\""), "{error}");
    assert!(load(&builder, Some(SceneChoice::Index(2))).is_err());
    builder.json["scene"] = json!(1);
    assert_eq!(load(&builder, None).unwrap().name, "b");
}

#[test]
fn clips_keep_their_keys_and_shapes() {
    let scene = load(&everything());
    let clip = &scene.clips[0];
    assert_eq!(clip.duration, 1.0);
    let Track::Translation(values) = &clip.channels[0].track else { panic!() };
    assert_eq!((clip.channels[0].interpolation, values.len()), (Interpolation::CubicSpline, 6));
    let Track::Rotation(values) = &clip.channels[1].track else { panic!() };
    assert_eq!(values, &[Quat::IDENTITY, Quat::from_xyzw(1.0, 0.0, 0.0, 0.0)]);
    assert_eq!(clip.channels[2].interpolation, Interpolation::Step);
    let Track::MorphWeights { target_count: 2, weights } = &clip.channels[3].track else { panic!() };
    assert_eq!(weights, &[0.0, 1.0, 1.0, 0.0]);
}

#[test]
fn cubic_rotation_tangents_are_left_as_they_are() {
    let mut builder = triangle();
    let input = builder.floats("SCALAR", &[0.0, 2.0]);
    let key = [0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 5.0, 0.0];
    let output = builder.floats("VEC4", &key.repeat(2));
    builder.push(
        "animations",
        json!({
            "samplers": [{ "input": input, "output": output, "interpolation": "CUBICSPLINE" }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "rotation" } }],
        }),
    );
    let scene = load(&builder);
    let Track::Rotation(values) = &scene.clips[0].channels[0].track else { panic!() };
    assert_eq!(values[..3], [Quat::from_xyzw(0., 3., 0., 0.), Quat::IDENTITY, Quat::from_xyzw(0., 0., 5., 0.)]);
}

#[test]
fn cameras_lights_and_matrices_are_read() {
    let scene = load(&everything());
    assert_eq!(scene.cameras[0].projection, Projection::Perspective { fov_y: 0.7, near: 0.1, far: None });
    let orthographic = Projection::Orthographic { half_width: 1.0, half_height: 1.0, near: 0.0, far: 10.0 };
    assert_eq!(scene.cameras[1].projection, orthographic);
    assert_eq!((scene.lights[0].kind, scene.lights[0].range), (LightKind::Point, Some(5.0)));
    assert_eq!(scene.lights[1].kind, LightKind::Spot { inner_angle: 0.1, outer_angle: 0.5 });
    assert_eq!(scene.lights[1].intensity, Vec3::new(1.0, 0.5, 0.25));
    assert_eq!((scene.lights[2].kind, scene.lights[2].intensity), (LightKind::Directional, Vec3::splat(2.0)));
    let matrix = scene.nodes.iter().find_map(|node| match node.transform {
        Transform::Matrix(matrix) => Some(matrix),
        Transform::Trs { .. } => None,
    });
    assert_eq!(matrix, Some(Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0))));
}

#[test]
fn unusable_cameras_and_lights_are_noted() {
    let camera = |camera: Value| {
        let mut builder = triangle();
        builder.push("cameras", camera);
        builder.json["nodes"][0]["camera"] = json!(0);
        load(&builder)
    };
    for (yfov, znear, zfar) in [(0.0, 0.1, 1.0), (4.0, 0.1, 1.0), (1.0, 0.0, 1.0), (1.0, 2.0, 1.0), (1.0, -1.0, 1.0)] {
        let lens = json!({ "yfov": yfov, "znear": znear, "zfar": zfar });
        let scene = camera(json!({ "type": "perspective", "perspective": lens }));
        assert!(scene.cameras.is_empty() && scene.notes[0].starts_with("A camera was left out: /cameras/0/"));
    }
    let mut builder = triangle();
    builder.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = json!(0);
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([{ "type": "area" }]);
    let scene = load(&builder);
    assert!(scene.lights.is_empty() && scene.nodes[0].light.is_none() && scene.notes.len() == 1);
}

#[test]
fn materials_are_read_with_their_extensions() {
    let scene = load(&everything());
    let material = &scene.materials[0];
    assert_eq!((material.metallic, material.roughness, material.normal_scale), (0.5, 0.5, 0.5));
    assert_eq!((material.emission, material.alpha_cutoff), (Vec3::splat(3.0), Some(0.25)));
    assert!(material.double_sided && !material.unlit);
    assert_eq!(material.metallic_roughness_texture.unwrap().uv_set, 1);
    let [u, v] = material.base_color_texture.unwrap().transform;
    let (sin, cos) = 0.3f32.sin_cos();
    assert_eq!([u, v], [[cos * 2.0, sin * 3.0, 0.1], [-sin * 2.0, cos * 3.0, 0.2]]);

    let mut builder = triangle();
    builder.push(
        "materials",
        json!({ "alphaMode": "BLEND", "extensions": {
            "KHR_materials_unlit": {},
            "KHR_materials_ior": { "ior": 1.33 },
            "KHR_materials_specular": { "specularFactor": 0.5, "specularColorFactor": [2, 1, 0.5] },
        }}),
    );
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let scene = load(&builder);
    let material = &scene.materials[0];
    assert!(material.unlit && material.alpha_cutoff == Some(0.5));
    assert_eq!((material.ior, material.specular), (1.33, 0.5));
    assert_eq!(material.specular_color, Vec3::new(2.0, 1.0, 0.5));
    assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
}

#[test]
fn an_image_used_as_colour_and_as_numbers_is_two_images() {
    let scene = load(&everything());
    let texture = |reference: Option<scene::TextureRef>| scene.textures[reference.unwrap().texture as usize];
    let material = &scene.materials[0];
    let (color, numbers) = (texture(material.base_color_texture), texture(material.metallic_roughness_texture));
    assert!(scene.images[color.image as usize].srgb && !scene.images[numbers.image as usize].srgb);
    assert_eq!(scene.images[0].rgba, scene.images[1].rgba);
    assert_eq!(texture(material.emission_texture), color);
    assert_eq!((color.wrap, color.mag_linear), ([scene::Wrap::ClampToEdge, scene::Wrap::MirroredRepeat], false));
    assert_eq!((color.min_linear, color.mipmapped, color.mip_linear), (true, true, false));
}

#[test]
fn data_uris_stand_for_files() {
    use base64::Engine;
    let encode = |bytes: &[u8]| base64::engine::general_purpose::STANDARD.encode(bytes);
    let mut builder = triangle();
    builder.push("images", json!({ "uri": format!("data:image/png;base64,{}", encode(&png(3, 2))) }));
    builder.push("textures", json!({ "source": 0 }));
    builder.push("materials", json!({ "emissiveTexture": { "index": 0 } }));
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let uri = format!("data:application/octet-stream;base64,{}", encode(&builder.binary));
    builder.json["buffers"] = json!([{ "byteLength": builder.binary.len(), "uri": uri }]);
    let scene = scene::load_bytes("test.gltf", builder.json.to_string().as_bytes()).unwrap();
    assert_eq!((scene.images[0].width, scene.images[0].height), (3, 2));
    assert_eq!(scene.meshes[0].primitives[0].positions[1], Vec3::X);
}

#[test]
fn instances_share_one_mesh() {
    let mut builder = triangle();
    let nodes: Vec<Value> = (0..100).map(|x| json!({ "mesh": 0, "translation": [x, 0, 0] })).collect();
    builder.json["nodes"] = json!(nodes);
    builder.json["scenes"] = json!([{ "nodes": (0..100).collect::<Vec<_>>() }]);
    let scene = load(&builder);
    assert_eq!((scene.meshes.len(), scene.nodes.len()), (1, 100));
}

/// The tangents that come with a professionally baked model are the ones computed for it without them.
#[test]
fn computed_tangents_agree_with_those_of_a_baked_model() {
    let Some(folder) = shared("scenes/models/FlightHelmet") else { return };
    let own = scene::load(&folder.join("FlightHelmet.gltf"), &LoadOptions::default()).unwrap();
    let copy = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let target = copy.path().join(path.file_name().unwrap());
        match path.extension().is_some_and(|extension| extension == "gltf") {
            true => {
                let text = std::fs::read_to_string(&path).unwrap();
                std::fs::write(target, text.replace("\"TANGENT\"", "\"_TANGENT\"")).unwrap();
            }
            false => drop(std::fs::copy(&path, target).unwrap()),
        }
    }
    let computed = scene::load(&copy.path().join("FlightHelmet.gltf"), &LoadOptions::default()).unwrap();
    let (mut agreeing, mut total) = (0, 0);
    for (own, computed) in own.meshes.iter().zip(&computed.meshes) {
        for (own, computed) in own.primitives.iter().zip(&computed.primitives) {
            for (a, b) in own.triangles.iter().flatten().zip(computed.triangles.iter().flatten()) {
                let (a, b) = (own.tangents[*a as usize], computed.tangents[*b as usize]);
                total += 1;
                agreeing += usize::from(a.w == b.w && a.truncate().dot(b.truncate()) > 0.95);
            }
        }
    }
    eprintln!("{agreeing} of {total} corners agree");
    assert!(agreeing as f64 > 0.98 * total as f64, "{agreeing} of {total}");
}
