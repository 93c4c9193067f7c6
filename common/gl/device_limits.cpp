#include "common/gl/device_limits.h"

#include <epoxy/gl.h>

#include <algorithm>

namespace strandcast::gl {
namespace {

constexpr uint64_t kMiB = 1024 * 1024;
constexpr const char* kByScene = "the groom";

// Guaranteed: minimum values of the tables "Implementation Dependent Values" of the OpenGL 4.5 core
// specification.
constexpr DeviceLimitRow kTable[] = {
    {DeviceLimit::VertexStorageBlocks, "storage blocks in the vertex stage",
     GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS, false, 0, 2, "render/strand.vert"},
    {DeviceLimit::FragmentStorageBlocks, "storage blocks in the fragment stage",
     GL_MAX_FRAGMENT_SHADER_STORAGE_BLOCKS, false, 8, 3, "render/lists.frag"},
    {DeviceLimit::TessellationStorageBlocks, "storage blocks in the tessellation evaluation stage",
     GL_MAX_TESS_EVALUATION_SHADER_STORAGE_BLOCKS, false, 0, 2, "render/expand.tese"},
    {DeviceLimit::ComputeStorageBlocks, "storage blocks in the compute stage",
     GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS, false, 8, 6, "sim/direct_rod.comp"},
    {DeviceLimit::StorageBlockBytes, "bytes in a storage block", GL_MAX_SHADER_STORAGE_BLOCK_SIZE, false,
     128 * kMiB, 0, kByScene},
    {DeviceLimit::UniformBlockBytes, "bytes in a uniform block", GL_MAX_UNIFORM_BLOCK_SIZE, false, 16'384,
     848, "sim/step.glsl"},
    {DeviceLimit::BufferTexels, "texels in a buffer texture", GL_MAX_TEXTURE_BUFFER_SIZE, false, 65'536, 0,
     kByScene},
    {DeviceLimit::ComputeTextureUnits, "textures in the compute stage", GL_MAX_COMPUTE_TEXTURE_IMAGE_UNITS,
     false, 16, 9, "render/tile_draw.comp"},
    {DeviceLimit::VertexTextureUnits, "textures in the vertex stage", GL_MAX_VERTEX_TEXTURE_IMAGE_UNITS,
     false, 16, 8, "render/shadow.glsl"},
    {DeviceLimit::FragmentTextureUnits, "textures in the fragment stage", GL_MAX_TEXTURE_IMAGE_UNITS, false,
     16, 11, "render/far_volume.frag"},
    {DeviceLimit::ComputeImages, "images in the compute stage", GL_MAX_COMPUTE_IMAGE_UNIFORMS, false, 8, 1,
     "render/tile_draw.comp"},
    {DeviceLimit::GroupSize, "invocations of a work group in one dimension", GL_MAX_COMPUTE_WORK_GROUP_SIZE,
     true, 1'024, 128, "sim/dftl_parallel.comp"},
    {DeviceLimit::GroupInvocations, "invocations of a work group", GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS,
     false, 1'024, 128, "sim/dftl_parallel.comp"},
    {DeviceLimit::GroupCount, "work groups in one dimension", GL_MAX_COMPUTE_WORK_GROUP_COUNT, true, 65'535,
     0, kByScene},
    {DeviceLimit::SharedBytes, "shared bytes of a work group", GL_MAX_COMPUTE_SHARED_MEMORY_SIZE, false,
     32'768, 8'704, "sim/dftl_parallel.comp"},
    {DeviceLimit::TessellationLevel, "tessellation level", GL_MAX_TESS_GEN_LEVEL, false, 64, 64,
     "render/expand.tese"},
    {DeviceLimit::CapturedComponents, "captured components", GL_MAX_TRANSFORM_FEEDBACK_INTERLEAVED_COMPONENTS,
     false, 64, 8, "render/expand.tese"},
    {DeviceLimit::TextureSize, "texels along a texture", GL_MAX_TEXTURE_SIZE, false, 16'384, 0,
     "the picture"},
};

constexpr bool is_in_order() {
  for (size_t i = 0; i < std::size(kTable); ++i)
    if (static_cast<size_t>(kTable[i].limit) != i) return false;
  return true;
}
static_assert(std::size(kTable) == kDeviceLimitCount && is_in_order());

Error too_low(ErrorCode code, const DeviceLimitRow& row, uint64_t needed, const std::string& user,
              uint64_t given) {
  return make_error(code, "{} needs {} {}, this device has {}", user, needed, row.name, given);
}

}  // namespace

std::span<const DeviceLimitRow> device_limit_table() {
  return kTable;
}

DeviceLimits read_device_limits() {
  DeviceLimits limits;
  for (const DeviceLimitRow& row : kTable) {
    GLint64 value = 0;
    if (row.is_indexed)
      glGetInteger64i_v(row.query, 0, &value);
    else
      glGetInteger64v(row.query, &value);
    limits.values[static_cast<size_t>(row.limit)] = static_cast<uint64_t>(std::max(value, GLint64{0}));
  }
  return limits;
}

Status check_device_limits(const DeviceLimits& limits) {
  for (const DeviceLimitRow& row : kTable)
    if (row.needed > limits.of(row.limit))
      return too_low(ErrorCode::Unsupported, row, row.needed, row.user, limits.of(row.limit));
  return {};
}

Status check_device_limit(const DeviceLimits& limits, DeviceLimit limit, uint64_t needed,
                          const std::string& user) {
  if (needed <= limits.of(limit)) return {};
  return too_low(ErrorCode::LimitExceeded, kTable[static_cast<size_t>(limit)], needed, user,
                 limits.of(limit));
}

}  // namespace strandcast::gl
