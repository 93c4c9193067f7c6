// StrandState: strands between two substeps on the GPU: rest, position and velocity of every vertex, and how
// the head moved. It belongs to whoever runs the simulation; solvers are passes that read and write it, and
// one may follow another on the same state. From one thread with its GL context current.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <string>
#include <vector>

#include "common/gl/objects.h"
#include "server/sim/head_path.h"
#include "server/sim/solver.h"
#include "server/sim/strand_layout.h"

namespace strandcast {

/// A buffer of vec4 with a buffer texture over all of it: kernels write the one and fetch from the other,
/// which on llvmpipe costs half of a storage-block load or less.
class StrandPlane {
 public:
  StrandPlane() = default;
  StrandPlane(const std::string& label, const std::vector<glm::vec4>& values);

  void bind_storage(uint32_t binding) const { buffer_.bind_storage(binding); }
  /// For texel fetches.
  void bind_view(uint32_t unit) const;
  void write(const std::vector<glm::vec4>& values) { buffer_.write(values); }
  /// Blocks until the GPU has written it.
  std::vector<glm::vec4> read() const { return buffer_.read_all<glm::vec4>(); }
  void read(std::vector<glm::vec4>& values) const;
  uint64_t size_bytes() const { return buffer_.size_bytes(); }

 private:
  gl::Buffer buffer_;
  gl::Handle<gl::delete_texture> view_;
};

/// Turns xyz of every element, in double; w stays.
void turn_plane(StrandPlane& plane, const glm::dquat& turn);

class StrandState {
 public:
  /// Sets every strand to rest under the given head rotation; allocates. BadInput as make_strand_layout(),
  /// Unsupported when the device's buffer textures are too small; the state is then as before.
  Status load(const Groom& groom, const glm::dquat& world_from_head_rotation);

  /// Counts, pinned vertices and rest lengths; `rest` of it as well, `arc` is in the buffers only.
  const StrandLayout& layout() const { return layout_; }
  const HeadPath& head() const { return head_; }
  /// As loaded: nothing moved a strand since.
  bool is_at_rest() const { return is_at_rest_; }

  /// The planes where every kernel expects them (shaders/sim/step.glsl).
  void bind() const;
  /// The kernels of a substep are on their way.
  void advance(const StepInput& input);

  /// Copies the state out; resizes `state` on first use only.
  void read(SolverState& state);
  /// Replaces positions and velocities. Returns which strands are not as they were: what a model keeps beside
  /// their velocity is 0 again.
  std::vector<bool> write(const SolverState& state);
  /// What the last model kept beside the velocities is 0 again.
  void forget_model();
  /// What the model keeps beside the velocity of every vertex, (vertex_count x strand_count).
  void write_model(const std::vector<float>& values);
  /// The head has jumped to this rotation; strands jump along and are in head space what they were. Returns
  /// the turn.
  glm::dquat rebase(const glm::dquat& world_from_head_rotation);

  uint64_t memory_bytes() const {
    return rest_.size_bytes() + position_.size_bytes() + velocity_.size_bytes();
  }

 private:
  StrandLayout layout_;
  HeadPath head_;
  bool is_at_rest_ = true;
  StrandPlane rest_;      // (vertex_count x strand_count) head space, m; segment before it, m
  StrandPlane position_;  // (vertex_count x strand_count) head-relative world, m; arc 0..1
  StrandPlane velocity_;  // (vertex_count x strand_count) world, m/s; of the model, 0 at first
  std::vector<glm::vec4> staging_;
};

}  // namespace strandcast
