// Strand pass: a camera-facing quad per expanded segment, shaded by the model that the look names, covered by
// a fixed pattern instead of sorted blending. All calls from the context's thread.
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

/// Segments that are drawn: all, or those with little or much hair behind them, as sample_choice.comp marks
/// them. strand.vert has the same numbers.
enum class StrandDepth : int { All, Shallow, Deep };

/// Quads of expanded segments with a program: for every pass that draws strands, seen from wherever.
class StrandDraw {
 public:
  static constexpr const char* kShadedStage = "render/strand.vert";
  static constexpr const char* kShadedFragment = "render/strand.frag";
  static constexpr uint32_t kCornersPerSegment = 4;
  static constexpr uint32_t kIndicesPerSegment = 6;
  /// Segments per draw such that 16-bit indices reach all corners.
  static constexpr uint32_t kSegmentsPerDraw = 65'536 / kCornersPerSegment;
  StrandDraw() = default;
  static Result<StrandDraw> make(const RenderSetup& setup, const RenderScene& scene,
                                 const std::string& fragment_stage, gl::Variant variant = {},
                                 const std::string& vertex_stage = kShadedStage);
  /// Program, buffers and what render/strand.vert has to know, for a target of this size. The target is bound
  /// by the caller.
  void begin(const RenderScene& scene, const ExpandedStrands& expanded, const RenderTurn& turn,
             glm::uvec2 target_px);
  /// Program and buffers alone, for another vertex stage.
  void bind(const ExpandedStrands& expanded);
  /// All segments that are expanded now; those that are chosen of them, where the camera draws and some are.
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

/// What programs with shaders/render/strand_light.glsl are compiled with and told, evaluated per vertex
/// unless they say otherwise.
gl::Variant strand_light_variant(const RenderScene& scene);
void set_strand_light(const RenderScene& scene, const gl::Program& program, const RenderTurn& turn);

/// A declaration of a pass that runs when there are strands.
gl::PassDeclaration strand_pass(const RenderScene& scene, std::string name, gl::Resources reads,
                                gl::Resources writes);

/// Draws the strands of each batch with a fragment stage of its own, as the camera sees them.
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

/// Between two walks: what the first one drew is read in the second.
std::unique_ptr<RenderPass> make_ready_pass(const RenderScene& scene, std::string name, gl::Resources reads,
                                            gl::Resources writes);
std::unique_ptr<RenderPass> make_strand_pass(RenderScene& scene, ExpandedStrands& expanded);

}  // namespace strandcast
