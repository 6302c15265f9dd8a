#ifndef LEAF_KEYS
#define LEAF_KEYS
// The links of a window's leaves while the last step of the sweep is done: the shorter of a leaf's own and its parent's.
// The kernel binds node_segments, segments, window_levels, receivers, keys, and has params n, is_turned.
const uint64_t NO_KEY = ~uint64_t(0);

uint own_row;
uint parent_row;        // its own where no parent receives
vec4 frame;

// For the leaf at that place of the window.
void begin_leaf(uint local)
{
    WindowLevel own = window_levels[0], above = window_levels[1];
    uint leaf = own.first + local;
    QuadtreeSegment segment = segments[node_segments[leaf]];
    own_row = own.row + local;
    uint parent = segment.parent_first == NO_PARENT ? 0 : quadtree_parent(segment, leaf);
    bool has_parent = segment.parent_first != NO_PARENT && parent >= above.first && parent - above.first < above.count;
    parent_row = has_parent ? above.row + parent - above.first : own_row;
    frame = receivers[leaf].frame;
}

// The nearest of the leaf's own link and its parent's in the same direction.
uint64_t key_of(uint bin)
{
    uint bin_count = 6 * params.n * params.n, parent_bin = bin;
    if (params.is_turned != 0 && parent_row != own_row)
        parent_bin = bin_of(turn(frame, bin_direction(bin, params.n)), params.n);   // parents' bins are not turned
    return min(keys[own_row * bin_count + bin], keys[parent_row * bin_count + parent_bin]);
}
#endif
