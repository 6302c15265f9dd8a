# Sourced by tools/setup and tools/env.sh: which Vulkan drivers this machine has. Functions only, no side effects.
# shellcheck shell=bash

# True when a Vulkan driver here drives real hardware. lavapipe and SwiftShader report themselves as CPU devices.
has_gpu() {
    local summary
    summary=$(env -u VK_DRIVER_FILES -u VK_ICD_FILENAMES vulkaninfo --summary 2>/dev/null) || return 1
    grep -qE 'deviceType *= PHYSICAL_DEVICE_TYPE_(DISCRETE|INTEGRATED|VIRTUAL)_GPU' <<<"$summary"
}

# The driver, named: machines often carry drivers for hardware that is not there. Tests use lavapipe everywhere.
use_lavapipe() {
    local manifest
    [ -z "${VK_DRIVER_FILES-}${VK_ICD_FILENAMES-}" ] || return 0
    for manifest in /usr/share/vulkan/icd.d/lvp_icd."$(uname -m)".json /usr/share/vulkan/icd.d/lvp_icd.json; do
        [ -r "$manifest" ] || continue
        export VK_DRIVER_FILES=$manifest
        return 0
    done
    echo 'linklight: no lavapipe driver under /usr/share/vulkan/icd.d; run tools/setup --test' >&2
    return 1
}
