#include "common/render/detail/chosen_segments.h"

#include <epoxy/gl.h>

#include <vector>

#include "common/render/passes/strand_pass.h"
#include "shaders/shared/bindings.h"

namespace strandcast {
namespace {

/// As glDrawElementsIndirect reads it, and shaders/render/cull_list.comp writes it.
struct DrawCommand {
  uint32_t count;
  uint32_t instance_count;
  uint32_t first_index;
  int32_t base_vertex;
  uint32_t base_instance;
};
static_assert(sizeof(DrawCommand) == 20);

}  // namespace

void ChosenSegments::allocate() {
  segment_ = gl::Buffer("chosen segment", sizeof(uint32_t) * size_t{max_segments_});
  command_ = gl::Buffer("draw command", sizeof(DrawCommand) * size_t{draw_count(max_segments_)});
}

void ChosenSegments::bind_for_writing() const {
  segment_.bind_storage(shader::kBindingChosen);
  command_.bind_storage(shader::kBindingDrawCommand);
}

void ChosenSegments::bind() const {
  segment_.bind_storage(shader::kBindingChosen);
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, command_.name());
}

uint32_t ChosenSegments::draw_count(uint32_t segments) const {
  return (segments + StrandDraw::kSegmentsPerDraw - 1) / StrandDraw::kSegmentsPerDraw;
}

void ChosenSegments::draw(uint32_t index) const {
  // An offset into the bound buffer, as OpenGL takes it.
  const auto* const offset = reinterpret_cast<const void*>(uintptr_t{index} * sizeof(DrawCommand));
  glDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_SHORT, offset);
}

uint32_t ChosenSegments::read_count(uint32_t segments) const {
  uint32_t indices = 0;
  const std::vector<DrawCommand> commands = command_.read_all<DrawCommand>();
  for (uint32_t draw = 0; draw < draw_count(segments); ++draw) indices += commands[draw].count;
  return indices / StrandDraw::kIndicesPerSegment;
}

uint64_t ChosenSegments::size_bytes() const {
  return sizeof(uint32_t) * uint64_t{max_segments_} +
         sizeof(DrawCommand) * uint64_t{draw_count(max_segments_)};
}

}  // namespace strandcast
