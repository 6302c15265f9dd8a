#ifndef LIB_SCENE
#define LIB_SCENE
// The scene as buffers hold it: one vertex per element, triangles with global indices, parts, materials, lights.
// Filled by stages/world. Lengths in metres, colours linear Rec. 709.

// Vertex as the file gives it, in mesh space.
struct LocalVertex {
    vec3 position;
    vec3 normal;
    vec4 tangent;       // xyz unit, w handedness
};

struct VertexAttributes {
    vec2 uv0;
    vec2 uv1;
    vec4 color;
};

// Attributes inside a triangle, by the weights of its vertices.
VertexAttributes interpolated(VertexAttributes p, VertexAttributes q, VertexAttributes r, vec3 w)
{
    VertexAttributes a;
    a.uv0 = w.x * p.uv0 + w.y * q.uv0 + w.z * r.uv0;
    a.uv1 = w.x * p.uv1 + w.y * q.uv1 + w.z * r.uv1;
    a.color = w.x * p.color + w.y * q.color + w.z * r.color;
    return a;
}

// One drawn (node, primitive) pair.
struct Part {
    mat4x3 world_from_local;
    mat3 normal_from_local;     // inverse transpose of the above up to a positive factor
    float mirror;               // -1 where world_from_local mirrors, else +1
    uint material;
    uint vertex_offset;
    uint vertex_count;
    uint skin_offset;           // first influence, NO_SKIN for rigid parts
    uint morph_target_count;
    uint morph_offset;          // first displacement
    uint morph_weight_offset;
};
const uint NO_SKIN = 0xffffffffu;

struct Influence {
    uint joints[8];
    float weights[8];
};

struct MorphDelta {
    vec3 position;
    vec3 normal;
    vec3 tangent;
};

// A texture with its UV set and transform: uv' = (dot(row_u, (u, v, 1)), dot(row_v, (u, v, 1))).
struct TextureSlot {
    uint texture;       // NO_TEXTURE: the factor alone
    uint uv_set;
    vec3 row_u;
    vec3 row_v;
};
const uint NO_TEXTURE = 0xffffffffu;

struct Material {
    vec4 base_color;
    vec3 emission;              // radiance, W m^-2 sr^-1
    float metallic;
    float roughness;
    float normal_scale;
    float alpha_cutoff;         // holes where alpha is below; negative: opaque
    uint flags;
    vec3 dielectric_f0;         // from index of refraction and specular colour
    float specular;             // weight of the dielectric lobe, also at grazing angles
    TextureSlot base_color_texture;
    TextureSlot metallic_roughness_texture;
    TextureSlot normal_texture;
    TextureSlot emission_texture;
};
const uint DOUBLE_SIDED = 1u;
const uint UNLIT = 2u;
const uint DIFFUSE_ONLY = 4u;   // --diffuse: Lambert with the base colour, no specular lobe

// KHR_lights_punctual in world space.
struct Light {
    vec3 position;
    uint kind;
    vec3 direction;     // unit, the way it shines
    float range;        // metres; 0 is unlimited
    vec3 intensity;     // W/sr; directional: W/m2
    float spot_scale;   // spot falloff = clamp(cos_angle * scale + offset, 0, 1)^2
    float spot_offset;
};
const uint LIGHT_POINT = 0u;
const uint LIGHT_SPOT = 1u;
const uint LIGHT_DIRECTIONAL = 2u;

// The environment's place in its tables; texels stand in an image, cells in a buffer.
struct EnvironmentInfo {
    vec3 constant;      // radiance where width is 0
    uint width;         // texels; 0: constant
    uint height;
    float rotation;     // radians about +Y
    uint cell_columns;
    uint cell_rows;
    uint cell_extent;   // texels a side of a cell
    uint is_black;
};

// Alias-table entry of a cell of the environment.
struct EnvironmentCell {
    float threshold;
    uint alias;
    float density;      // of directions in the cell, sr^-1
};
#endif
