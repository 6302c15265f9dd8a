# Sourced by tools/test, tools/demo and .ci/run: which Vulkan driver, validation layer and caches a run uses.
# Sets nothing that the caller has set already. `. tools/env.sh` in a shell gives `cargo test` the same surroundings.
# shellcheck shell=bash

linklight_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
linklight_target=${CARGO_TARGET_DIR:-$linklight_root/target}
case $linklight_target in /*) ;; *) linklight_target=$PWD/$linklight_target ;; esac

# shellcheck source=tools/drivers.sh
. "$linklight_root/tools/drivers.sh"

# Drivers and window systems complain, or refuse, without a private run-time folder.
use_runtime_folder() {
    [ ! -d "${XDG_RUNTIME_DIR-}" ] || return 0
    export XDG_RUNTIME_DIR=$linklight_target/run
    mkdir -p "$XDG_RUNTIME_DIR"
    chmod 700 "$XDG_RUNTIME_DIR"
}

# lavapipe compiles each shader anew in each process unless Mesa keeps them on disk.
use_shader_cache() {
    export MESA_SHADER_CACHE_DIR=${MESA_SHADER_CACHE_DIR:-$linklight_target/mesa-shader-cache}
    mkdir -p "$MESA_SHADER_CACHE_DIR"
}

# The validation layer inside the package chromium-common is years newer than Debian's own and finds hazards that
# one misses. The package has no manifest for the loader, so one is written here. Without the package, the system's
# layer is used as it is.
use_newest_validation() {
    local library=/usr/lib/chromium/libVkLayer_khronos_validation.so folder=$linklight_target/vulkan-layers
    # Without this, synchronization validation reports no hazard between shader accesses at all.
    export VK_LAYER_SYNCVAL_SHADER_ACCESSES_HEURISTIC=${VK_LAYER_SYNCVAL_SHADER_ACCESSES_HEURISTIC:-1}
    [ -z "${VK_LAYER_PATH-}${VK_ADD_LAYER_PATH-}" ] || return 0
    [ -r "$library" ] || return 0
    mkdir -p "$folder"
    cat >"$folder/VkLayer_khronos_validation.json.$$" <<JSON
{
    "file_format_version": "1.2.0",
    "layer": {
        "name": "VK_LAYER_KHRONOS_validation",
        "type": "GLOBAL",
        "library_path": "$library",
        "api_version": "1.4.0",
        "implementation_version": "1",
        "description": "Khronos validation layer of chromium-common",
        "instance_extensions": [
            { "name": "VK_EXT_debug_report", "spec_version": "9" },
            { "name": "VK_EXT_debug_utils", "spec_version": "1" },
            { "name": "VK_EXT_validation_features", "spec_version": "2" },
            { "name": "VK_EXT_layer_settings", "spec_version": "2" }
        ]
    }
}
JSON
    mv "$folder/VkLayer_khronos_validation.json.$$" "$folder/VkLayer_khronos_validation.json"
    export VK_ADD_LAYER_PATH=$folder
}

use_runtime_folder
use_shader_cache
use_newest_validation
