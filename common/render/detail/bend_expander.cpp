#include "common/render/detail/bend_expander.h"

#include <epoxy/gl.h>

#include <utility>

#include "common/render/passes/picture_target.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

// Of a pixel of the picture: what nobody sees.
constexpr float kTolerancePx = 0.25f;

}  // namespace

Result<BendExpander> BendExpander::make(const gl::ShaderLibrary& shaders, StrandCurves curves,
                                        uint64_t max_gaps) {
  BendExpander expander;
  gl::Variant variant = curves.variant();
  variant["IS_COUNTING"] = 1;
  ASSIGN_OR_RETURN(expander.count_program_,
                   gl::Program::make(shaders, {"render/bends_expand.comp"}, variant));
  variant["IS_COUNTING"] = 0;
  ASSIGN_OR_RETURN(expander.write_program_,
                   gl::Program::make(shaders, {"render/bends_expand.comp"}, variant));
  ASSIGN_OR_RETURN(expander.sum_, RunningSum::make(shaders, max_gaps));
  expander.curves_ = std::move(curves);
  return expander;
}

uint32_t BendExpander::run(const KeyStrands& keys, const ExpandedStrands& expanded, uint32_t first,
                           uint32_t count, const ExpandLevel& level, const View& view) const {
  const uint32_t gaps = count * (keys.vertex_count() - 1);
  if (gaps == 0) return 0;
  const auto run_kernel = [&](const gl::Program& program) {
    curves_.set(program, keys, level);
    sum_.bind();
    program.set("u_first_strand", first);
    program.set("u_strands", count);
    program.set("u_segments", level.segments_per_gap);
    glDispatchCompute((gaps + shader::kStrandLocalSize - 1) / shader::kStrandLocalSize, 1, 1);
  };
  count_program_.use();
  count_program_.set("u_clip_from_head", view.clip_from_head);
  count_program_.set("u_focal_px", view.focal_px / static_cast<float>(kSamplesPerSide));
  count_program_.set("u_near_m", view.near_m);
  count_program_.set("u_tolerance_px", kTolerancePx);
  run_kernel(count_program_);
  sum_.run(gaps);
  write_program_.use();
  expanded.vertex().bind_storage(shader::kBindingExpanded);
  run_kernel(write_program_);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  return sum_.read_total(gaps);
}

}  // namespace strandcast
