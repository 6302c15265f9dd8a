// What every shader starts with: the extensions in use and the index of a thread in a list.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : enable

// Lists longer than one dispatch dimension allows are folded into rows; see Recorder::dispatch.
#define linear_index() (gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x)
