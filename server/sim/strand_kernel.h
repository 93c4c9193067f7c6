// StrandKernel: the parts that GPU solvers with one compute dispatch per substep share: buffers, uniform
// block, variants, read and write. Used from one thread with its GL context current.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "server/sim/solver_registry.h"
#include "server/sim/step_block.h"

namespace strandcast {

/// Whether the current context's device is a processor: shared memory is ordinary memory there, and barriers
/// cost more than the work between them.
bool is_software_device();

/// What tells one kernel from another.
struct StrandKernelDesc {
  std::string name;         // labels
  std::string shader_path;  // below shaders/
  bool is_per_vertex =
      false;  // group = whole strands, one invocation per vertex; else one invocation per strand
  uint32_t local_size = 0;
  uint32_t iterations = 0;  // odd-even only
  bool has_exact_length = false;
  bool has_offset = false;  // a strand beside the state; one that is written starts without any
  std::map<std::string, glm::vec4> uniforms;  // of the model, the same in every step
};

class StrandKernel final : public Solver {
 public:
  /// Unsupported or Internal when a needed variant does not compile.
  static Result<std::unique_ptr<Solver>> make(StrandKernelDesc desc, const StrandParameters& parameters,
                                              const GpuSolverContext& context);

  Status load(const Groom& groom, const glm::dquat& world_from_head) override;
  void substep(const StepInput& input) override;
  void read(SolverState& state) override;
  void write(const SolverState& state) override;
  uint64_t memory_bytes() const override;

 private:
  StrandKernel(StrandKernelDesc desc, const StrandParameters& parameters, const SceneFeatures& features,
               const gl::ShaderLibrary& shaders)
      : desc_(std::move(desc)), parameters_(parameters), features_(features), shaders_(shaders) {}

  Status compile(bool has_pinned_tail);
  void upload(const StrandLayout& layout);
  void clear_offset(const std::vector<bool>& is_changed);
  const gl::Program& program_for(size_t collider_count) const;

  StrandKernelDesc desc_;
  StrandParameters parameters_;
  SceneFeatures features_;
  gl::ShaderLibrary shaders_;
  std::map<uint32_t, gl::Program> programs_;  // by how many colliders they can hold
  bool is_compiled_for_tail_ = false;

  StrandLayout layout_;
  glm::dquat previous_rotation_{1.0, 0.0, 0.0, 0.0};
  uint32_t step_index_ = 0;              // since load()
  glm::dmat3 previous_turn_per_s_{0.0};  // velocity of a point by the head's turn in the substep before
  gl::Buffer rest_;      // (vertex_count x strand_count) vec4: head space, m; segment before it, m
  gl::Buffer position_;  // (vertex_count x strand_count) vec4: head-relative world, m; arc 0..1
  gl::Buffer velocity_;  // (vertex_count x strand_count) vec4: world, m/s; of the model, 0 at first
  gl::Buffer offset_;  // (vertex_count x strand_count) vec4: second strand less the state, m; has_offset only
  gl::Buffer step_;    // StepBlock
  gl::Handle<gl::delete_texture> rest_view_;
  gl::Handle<gl::delete_texture> position_view_;
  gl::Handle<gl::delete_texture> velocity_view_;
  gl::Handle<gl::delete_texture> offset_view_;
  std::vector<glm::vec4> staging_;
};

}  // namespace strandcast
