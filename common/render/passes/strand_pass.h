// Strand pass: draws a camera-facing quad per expanded segment, shaded by the look's model. A fixed coverage
// pattern replaces sorted blending. All calls from the context's thread.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "common/base/result.h"
#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/render/passes/strand_buffers.h"
#include "common/render/render_scene.h"
#include "common/render/render_turn.h"

namespace strandcast {

/// Which segments are drawn: all, or those with little or much hair behind them, as sample_choice.comp marks
/// them. strand.vert uses the same numbers.
enum class StrandDepth : int { All, Shallow, Deep };

/// Draws expanded segments as quads with a program, from any view point; used by every pass that draws
/// strands.
class StrandDraw {
 public:
  static constexpr const char* kShadedStage = "render/strand.vert";
  static constexpr const char* kShadedFragment = "render/strand.frag";
  static constexpr uint32_t kCornersPerSegment = 4;
  static constexpr uint32_t kIndicesPerSegment = 6;
  /// Segments per draw, chosen so that 16-bit indices reach all corners.
  static constexpr uint32_t kSegmentsPerDraw = 65'536 / kCornersPerSegment;
  StrandDraw() = default;
  static Result<StrandDraw> make(const RenderSetup& setup, const RenderScene& scene,
                                 const std::string& fragment_stage, gl::Variant variant = {},
                                 const std::string& vertex_stage = kShadedStage);
  /// Activates the program and buffers, and sets the inputs of render/strand.vert for a target of this size.
  /// The caller binds the target.
  void begin(const RenderScene& scene, const ExpandedStrands& expanded, const RenderTurn& turn,
             glm::uvec2 target_px);
  /// Activates program and buffers only, for another vertex stage.
  void bind(const ExpandedStrands& expanded);
  /// Draws all expanded segments, or only the chosen ones if the camera draws and segments were chosen.
  void draw(const RenderScene& scene, const ExpandedStrands& expanded) const;
  const gl::Program& program() const { return program_; }
  static uint64_t size_bytes();

 private:
  gl::Program program_;
  gl::VertexArray vertex_array_;
  gl::Buffer quad_index_;
  bool is_shaded_ = false;  // by the stage that knows which share of the strands is shown
  bool is_chosen_ = false;
};

/// Variant and uniforms of programs with shaders/render/strand_light.glsl. Light is evaluated per vertex
/// unless the program says otherwise.
gl::Variant strand_light_variant(const RenderScene& scene);
void set_strand_light(const RenderScene& scene, const gl::Program& program, const RenderTurn& turn);

/// Declares a pass that runs if there are strands.
gl::PassDeclaration strand_pass(const RenderScene& scene, std::string name, gl::Resources reads,
                                gl::Resources writes);

/// Draws the strands of each batch as the camera sees them, with a fragment stage of its own.
class StrandDrawPass : public RenderPass {
 public:
  StrandDrawPass(RenderScene& scene, ExpandedStrands& expanded, gl::PassDeclaration declaration,
                 std::string fragment_stage)
      : Pass(std::move(declaration)),
        scene_(scene),
        expanded_(expanded),
        fragment_stage_(std::move(fragment_stage)) {}
  bool is_batched() const override { return true; }
  uint64_t size_bytes() const override { return StrandDraw::size_bytes(); }
  Status prepare(const RenderSetup& setup) override;

 protected:
  RenderScene& scene_;
  ExpandedStrands& expanded_;
  StrandDraw strands_;

 private:
  std::string fragment_stage_;
};

/// Makes the pass between two walks, after which the second walk can read what the first one drew.
std::unique_ptr<RenderPass> make_ready_pass(const RenderScene& scene, std::string name, gl::Resources reads,
                                            gl::Resources writes);
std::unique_ptr<RenderPass> make_strand_pass(RenderScene& scene, ExpandedStrands& expanded);

}  // namespace strandcast
