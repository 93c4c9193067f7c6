// Limits of an OpenGL device that our shaders and buffers need beyond those guaranteed by OpenGL 4.5, in one
// table. Checked when a context is made and, where a size follows from the scene, when buffers are allocated.
// shaders/README.md lists them; a test compares them with what linked programs use. Reading needs a current
// context; the rest is plain logic for any thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "common/base/result.h"

namespace strandcast::gl {

enum class DeviceLimit : uint8_t {
  VertexStorageBlocks,
  FragmentStorageBlocks,
  TessellationStorageBlocks,
  ComputeStorageBlocks,
  StorageBlockBytes,
  UniformBlockBytes,
  BufferTexels,
  ComputeTextureUnits,
  VertexTextureUnits,
  FragmentTextureUnits,
  ComputeImages,
  GroupSize,
  GroupInvocations,
  GroupCount,
  SharedBytes,
  TessellationLevel,
  CapturedComponents,
  TextureSize,
};
inline constexpr size_t kDeviceLimitCount = 18;

struct DeviceLimitRow {
  DeviceLimit limit;
  const char* name;     // as in sentences
  uint32_t query;       // of glGet
  bool is_indexed;      // the query has one value per dimension; the first counts
  uint64_t guaranteed;  // by OpenGL 4.5
  uint64_t needed;      // whatever the scene; 0 where the scene decides
  const char* user;     // who needs the most, or who checks where the scene decides
};

/// Returns the limits in the order of DeviceLimit.
std::span<const DeviceLimitRow> device_limit_table();

/// Values that a device offers, by DeviceLimit.
struct DeviceLimits {
  std::array<uint64_t, kDeviceLimitCount> values{};

  uint64_t of(DeviceLimit limit) const { return values[static_cast<size_t>(limit)]; }
};

/// Reads the limits of the current context.
DeviceLimits read_device_limits();

/// Checks the limits that every scene needs. Unsupported names the first one that is too low, with the needed
/// and the given value.
Status check_device_limits(const DeviceLimits& limits);

/// Checks one limit for a size that follows from the scene; `user` names what needs it. LimitExceeded states
/// the needed and the given value.
Status check_device_limit(const DeviceLimits& limits, DeviceLimit limit, uint64_t needed,
                          const std::string& user);

}  // namespace strandcast::gl
