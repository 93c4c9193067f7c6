// Executor: what runs the strand kernels of shaders/sim and keeps the strands' state for them: OpenGL
// (gl_executor.h), or the processors, a strand per lane of a vector register (lanes_executor.h). Solvers are
// written against this and know neither. Planes, tables and programs live no longer than their executor. From
// one thread.
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
#include "common/kernels/step_block.h"
#include "common/kernels/strand_blocks.h"
#include "common/kernels/volume/hair_volume.h"
#include "common/scene/features.h"
#include "server/sim/strand_layout.h"

namespace strandcast::gl {
class GpuTimer;
}  // namespace strandcast::gl

namespace strandcast {

/// A vec4 for every strand in each of its rows: for most planes a row is a vertex. Outside of the executor
/// the order is row-major with the strand fastest, (rows x strand_count).
class StrandPlane {
 public:
  virtual ~StrandPlane() = default;
  /// As many values as the plane was made of.
  virtual void write(std::span<const glm::vec4> values) = 0;
  /// Waits until kernels have written it; resizes `values` on first use only.
  virtual void read(std::vector<glm::vec4>& values) const = 0;
  virtual uint64_t size_bytes() const = 0;
  /// Its own memory where that is such blocks, until the next kernel runs or write(); else nothing.
  virtual std::optional<StrandBlocksView> view() const { return {}; }
};

/// An array of vec4 that kernels look things up in, at an index that differs between strands.
class LookupTable {
 public:
  virtual ~LookupTable() = default;
  /// As many values as it has elements.
  virtual void write(std::span<const glm::vec4> values) = 0;
  /// Its own memory where host code may fill it without a copy, while no kernel runs; else nothing.
  virtual std::span<glm::vec4> memory() { return {}; }
  virtual uint64_t size_bytes() const = 0;
};

/// Turns xyz of every element, in double; w stays.
void turn_plane(StrandPlane& plane, const glm::dquat& turn);

/// By role; nullptr = the kernel does not touch it.
using BoundPlanes = std::array<StrandPlane*, kPlaneRoleCount>;
inline StrandPlane*& plane_of(BoundPlanes& planes, PlaneRole role) {
  return planes[static_cast<size_t>(role)];
}

/// By role; nullptr = the kernel looks nothing up in it.
using BoundTables = std::array<LookupTable*, kTableRoleCount>;
inline LookupTable*& table_of(BoundTables& tables, TableRole role) {
  return tables[static_cast<size_t>(role)];
}

/// A kernel with its constants, ready to run.
class KernelProgram {
 public:
  virtual ~KernelProgram() = default;
  /// Once for all strands. What it stores is there for the next run and for read().
  virtual void run(const StepBlock& step, size_t collider_count, const BoundPlanes& planes,
                   const BoundTables& tables) = 0;
  void run(const StepBlock& step, size_t collider_count, const BoundPlanes& planes) {
    run(step, collider_count, planes, {});
  }
  /// Of its own, scratch above all.
  virtual uint64_t size_bytes() const = 0;
};

/// What is wanted of a volume that the executor's device makes of planes (common/kernels/volume).
struct DeviceVolumeDesc {
  std::string scatter;       // how strands are added up: one of kVolumeScatters but "auto" and "host"
  const HairVolume* volume;  // of the same strands on the host; read by make_volume() only
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  uint32_t smoothing = 1;
  bool has_way = false;  // motion is the plane of every vertex's way in the last substep
  bool is_ahead = true;  // of the strands as they will be after the substep
};

/// What a device found of strands.
struct DeviceVolumeFacts {
  VolumeGrid grid;
  uint64_t outside_count = 0;  // samples beyond the grid's limits, or no number
};

/// A hair volume made where the strands are, without waiting for anything: grid and sums as HairVolume's but
/// for roundings, the same bits every time.
class DeviceVolume {
 public:
  virtual ~DeviceVolume() = default;
  /// Fills `table` as shaders/sim/volume.glsl reads it. `motion`: velocities, or ways.
  virtual void update(const StepBlock& step, const StrandPlane& position, const StrandPlane& motion,
                      LookupTable& table) = 0;
  /// Of the last update, and the nodes that it left in its table; waits for it.
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
  /// Binds what it needs to the calling thread.
  virtual Status make_current() { return {}; }
  /// LimitExceeded when planes of such strands are too large for it.
  virtual Status check_size(const StrandLayout& layout) const = 0;
  /// (rows x strand_count) values.
  virtual std::unique_ptr<StrandPlane> make_plane(const std::string& label, uint32_t strand_count,
                                                  std::span<const glm::vec4> values) = 0;
  /// Zero at first. LimitExceeded when the device looks up fewer elements.
  virtual Result<std::unique_ptr<LookupTable>> make_table(const std::string& label,
                                                          uint32_t element_count) = 0;
  /// Compiles where it has to: not while a program of the same kernel, constants and features is there. Of
  /// `layout` only the counts matter. BadInput for a constant that the kernel does not declare, or when it
  /// does not compile; Unsupported for a kernel that this executor does not run, LimitExceeded for too many
  /// strands.
  virtual Result<std::unique_ptr<KernelProgram>> make_program(const KernelDesc& desc,
                                                              const SceneFeatures& features,
                                                              const StrandLayout& layout) = 0;
  /// Unsupported where the device makes none, or not so; LimitExceeded when it would be too large for it.
  /// Tables that it fills have room for the host's volume.
  virtual Result<std::unique_ptr<DeviceVolume>> make_volume(const DeviceVolumeDesc& desc);
  /// For timing what runs on a device of its own; nullptr: a clock of the calling thread does.
  virtual gl::GpuTimer* timer() { return nullptr; }
};

/// Milliseconds that `work` takes on the executor, which is waited for.
double timed_ms(Executor& executor, const std::function<void()>& work);

struct ExecutorConfig {
  std::string sim_device = "auto";  // lanes unless the OpenGL device is hardware; "gl", "lanes"
  std::string gl_device = "auto";   // as EglContext::make
  std::optional<std::filesystem::path> shader_folder;  // none: the shaders in the binary. Of OpenGL only
};

/// Names that ExecutorConfig::sim_device takes: "auto", "gl", "lanes".
bool is_sim_device_name(const std::string& name);
/// Makes it current. "gl", and an OpenGL device that is named, fail where it is not there: Unavailable, or
/// BadInput for an unknown name.
Result<std::unique_ptr<Executor>> open_executor(const ExecutorConfig& config);

}  // namespace strandcast
