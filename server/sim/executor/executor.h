// Executor: runs the strand kernels of shaders/sim and stores the state of the strands for them.
// Implementations: OpenGL (gl_executor.h), and the processors with a strand per lane of a vector register
// (lanes_executor.h). Solvers depend only on this interface. Planes, tables and programs must not outlive
// their executor. One thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/kernels/kernel_desc.h"
#include "common/kernels/plane_role.h"
#include "common/kernels/step_input.h"
#include "common/kernels/strand_blocks.h"
#include "common/kernels/volume/hair_volume.h"
#include "common/scene/features.h"
#include "server/sim/strand_layout.h"

namespace strandcast::gl {
class GpuTimer;
}  // namespace strandcast::gl

namespace strandcast {

/// A vec4 per strand in each of its rows; in most planes a row is a vertex. Values passed in and out are
/// row-major with the strand fastest, (rows x strand_count).
class StrandPlane {
 public:
  virtual ~StrandPlane() = default;
  /// Writes all values; their number must be that of the plane.
  virtual void write(std::span<const glm::vec4> values) = 0;
  /// Reads all values; waits until kernels have written them. Resizes `values` only on first use.
  virtual void read(std::vector<glm::vec4>& values) const = 0;
  virtual uint64_t size_bytes() const = 0;
  /// Returns the plane's own memory if it consists of blocks of strands; valid until the next kernel run or
  /// write(). Otherwise empty.
  virtual std::optional<StrandBlocksView> view() const { return {}; }
};

/// An array of vec4 that kernels read at indices that differ between strands.
class LookupTable {
 public:
  virtual ~LookupTable() = default;
  /// Writes all elements; their number must be that of the table.
  virtual void write(std::span<const glm::vec4> values) = 0;
  /// Returns the table's own memory if the host may fill it directly while no kernel runs; otherwise empty.
  virtual std::span<glm::vec4> memory() { return {}; }
  virtual uint64_t size_bytes() const = 0;
};

/// Rotates xyz of every element in double precision; w is unchanged.
void turn_plane(StrandPlane& plane, const glm::dquat& turn);

/// Planes by role; nullptr = the kernel does not use it.
using BoundPlanes = std::array<StrandPlane*, kPlaneRoleCount>;
inline StrandPlane*& plane_of(BoundPlanes& planes, PlaneRole role) {
  return planes[static_cast<size_t>(role)];
}

/// Tables by role; nullptr = the kernel does not use it.
using BoundTables = std::array<LookupTable*, kTableRoleCount>;
inline LookupTable*& table_of(BoundTables& tables, TableRole role) {
  return tables[static_cast<size_t>(role)];
}

/// A compiled kernel with its constants.
class KernelProgram {
 public:
  virtual ~KernelProgram() = default;
  /// Runs the kernel once for all strands. Its output is available to the next run and to read().
  virtual void run(const StepBlock& step, size_t collider_count, const BoundPlanes& planes,
                   const BoundTables& tables) = 0;
  void run(const StepBlock& step, size_t collider_count, const BoundPlanes& planes) {
    run(step, collider_count, planes, {});
  }
  /// Returns the bytes of the program's own memory, mainly scratch.
  virtual uint64_t size_bytes() const = 0;
};

/// Description of a volume that the executor's device computes from planes (common/kernels/volume).
struct DeviceVolumeDesc {
  std::string scatter;       // how strands are added up: one of kVolumeScatters but "auto" and "host"
  const HairVolume* volume;  // of the same strands on the host; read by make_volume() only
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  uint32_t smoothing = 1;
  bool has_way = false;  // motion is the plane of every vertex's way in the last substep
  bool is_ahead = true;  // of the strands as they will be after the substep
};

/// Results of a device about its volume.
struct DeviceVolumeFacts {
  VolumeGrid grid;
  uint64_t outside_count = 0;  // samples beyond the grid's limits, or no number
};

/// A hair volume computed where the strands are stored, without waiting. Grid and sums equal those of
/// HairVolume except for rounding, with the same bits every time.
class DeviceVolume {
 public:
  virtual ~DeviceVolume() = default;
  /// Fills `table` in the layout that shaders/sim/volume.glsl reads. `motion` holds velocities or
  /// displacements.
  virtual void update(const StepBlock& step, const StrandPlane& position, const StrandPlane& motion,
                      LookupTable& table) = 0;
  /// Read the facts of the last update and the nodes in its table; both wait for the device.
  virtual DeviceVolumeFacts read_facts() const = 0;
  virtual void read_nodes(const LookupTable& table, std::vector<glm::vec4>& nodes) const = 0;
  virtual uint64_t size_bytes() const = 0;
};

enum class SimDevice { Gl, Lanes };
const char* to_string(SimDevice device);

struct ExecutorInfo {
  SimDevice device = SimDevice::Gl;
  std::string name;         // for people: "OpenGL, NVIDIA ...", "lanes (AVX-512, 2 threads)"
  bool is_software = true;  // it runs on processor cores
};

class Executor {
 public:
  virtual ~Executor() = default;
  virtual const ExecutorInfo& info() const = 0;
  /// Binds the executor's resources to the calling thread.
  virtual Status make_current() { return {}; }
  /// Returns LimitExceeded if planes of such strands are too large.
  virtual Status check_size(const StrandLayout& layout) const = 0;
  /// Makes a plane with (rows x strand_count) values.
  virtual std::unique_ptr<StrandPlane> make_plane(const std::string& label, uint32_t strand_count,
                                                  std::span<const glm::vec4> values) = 0;
  /// Makes a table filled with zeros. LimitExceeded if the device supports fewer elements.
  virtual Result<std::unique_ptr<LookupTable>> make_table(const std::string& label,
                                                          uint32_t element_count) = 0;
  /// Makes a program; compiles only if none with the same kernel, constants and features exists. Only the
  /// counts of `layout` matter. BadInput for a constant that the kernel does not declare, and if it does not
  /// compile. Unsupported for a kernel that this executor does not run, LimitExceeded for too many strands.
  virtual Result<std::unique_ptr<KernelProgram>> make_program(const KernelDesc& desc,
                                                              const SceneFeatures& features,
                                                              const StrandLayout& layout) = 0;
  /// Makes a volume on the device. Unsupported if the device has none, or not this kind; LimitExceeded if it
  /// is too large. Tables that it fills must have room for the host's volume.
  virtual Result<std::unique_ptr<DeviceVolume>> make_volume(const DeviceVolumeDesc& desc);
  /// Returns the timer of the executor's device; nullptr: the clock of the calling thread suffices.
  virtual gl::GpuTimer* timer() { return nullptr; }
};

/// Runs `work` on the executor, waits for it and returns the milliseconds that it took.
double timed_ms(Executor& executor, const std::function<void()>& work);

struct ExecutorConfig {
  std::string sim_device = "auto";  // lanes unless the OpenGL device is hardware; "gl", "lanes"
  std::string gl_device = "auto";   // as EglContext::make
  std::optional<std::filesystem::path> shader_folder;  // none: the shaders in the binary. Of OpenGL only
};

/// Returns whether ExecutorConfig::sim_device accepts this name: "auto", "gl" or "lanes".
bool is_sim_device_name(const std::string& name);
/// Returns what open_executor() would simulate on. Where that depends on the hardware, opens an OpenGL
/// context for a moment.
SimDevice likely_sim_device(const ExecutorConfig& config);
/// Opens an executor and makes it current. If "gl" or a named OpenGL device is missing, returns Unavailable;
/// BadInput for an unknown name.
Result<std::unique_ptr<Executor>> open_executor(const ExecutorConfig& config);

}  // namespace strandcast
