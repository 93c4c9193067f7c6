#include "server/sim/strand_state.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "common/base/check.h"
#include "common/gl/device_limits.h"
#include "shaders/shared/bindings.h"

namespace strandcast {
namespace {

Status check_size(const StrandLayout& layout) {
  const gl::DeviceLimits limits = gl::read_device_limits();
  const std::string user =
      fmt::format("a groom of {} strands x {} vertices", layout.strand_count, layout.vertex_count);
  RETURN_IF_ERROR(gl::check_device_limit(limits, gl::DeviceLimit::BufferTexels, layout.size(), user));
  return gl::check_device_limit(limits, gl::DeviceLimit::StorageBlockBytes, layout.size() * sizeof(glm::vec4),
                                user);
}

void copy_vectors(const std::vector<glm::vec4>& from, std::vector<glm::vec3>& to) {
  to.resize(from.size());
  std::transform(from.begin(), from.end(), to.begin(), [](const glm::vec4& v) { return glm::vec3(v); });
}

}  // namespace

StrandPlane::StrandPlane(const std::string& label, const std::vector<glm::vec4>& values)
    : buffer_(gl::Buffer::of(label, values)) {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_BUFFER, 1, &name);
  glTextureBuffer(name, GL_RGBA32F, buffer_.name());
  glObjectLabel(GL_TEXTURE, name, -1, label.c_str());
  view_ = gl::Handle<gl::delete_texture>(name);
}

void StrandPlane::bind_view(uint32_t unit) const {
  glBindTextureUnit(unit, view_.name());
}

void StrandPlane::read(std::vector<glm::vec4>& values) const {
  values.resize(buffer_.size_bytes() / sizeof(glm::vec4));
  buffer_.read(0, std::as_writable_bytes(std::span(values)));
}

void turn_plane(StrandPlane& plane, const glm::dquat& turn) {
  std::vector<glm::vec4> values = plane.read();
  for (glm::vec4& value : values) value = glm::vec4(glm::vec3(turn * glm::dvec3(value)), value.w);
  plane.write(values);
}

Status StrandState::load(const Groom& groom, const glm::dquat& world_from_head_rotation) {
  ASSIGN_OR_RETURN(StrandLayout layout, make_strand_layout(groom));
  RETURN_IF_ERROR(check_size(layout));
  head_ = HeadPath::at_rest(world_from_head_rotation);
  is_at_rest_ = true;
  rest_ = StrandPlane("strand rest", layout.rest);
  staging_.resize(layout.size());
  for (size_t i = 0; i < staging_.size(); ++i) {
    const glm::dvec3 position = head_.world_from_head_rotation * glm::dvec3(layout.rest[i]);
    staging_[i] = glm::vec4(glm::vec3(position), layout.arc[i]);
  }
  position_ = StrandPlane("strand position", staging_);
  std::fill(staging_.begin(), staging_.end(), glm::vec4(0.0f));
  velocity_ = StrandPlane("strand velocity", staging_);
  layout.arc = {};
  layout_ = std::move(layout);
  return {};
}

void StrandState::bind() const {
  position_.bind_storage(shader::kBindingPosition);
  velocity_.bind_storage(shader::kBindingVelocity);
  rest_.bind_view(shader::kUnitRest);
  position_.bind_view(shader::kUnitPosition);
  velocity_.bind_view(shader::kUnitVelocity);
}

void StrandState::advance(const StepInput& input) {
  head_.advance(input);
  is_at_rest_ = false;
}

void StrandState::read(SolverState& state) {
  position_.read(staging_);
  copy_vectors(staging_, state.position_m);
  velocity_.read(staging_);
  copy_vectors(staging_, state.velocity_mps);
}

std::vector<bool> StrandState::write(const SolverState& state) {
  CHECK(state.position_m.size() == layout_.size() && state.velocity_mps.size() == layout_.size());
  std::vector<bool> is_changed(layout_.strand_count, false);
  position_.read(staging_);  // keeps w
  for (size_t i = 0; i < staging_.size(); ++i) {
    if (glm::vec3(staging_[i]) != state.position_m[i]) is_changed[i % layout_.strand_count] = true;
    staging_[i] = glm::vec4(state.position_m[i], staging_[i].w);
  }
  position_.write(staging_);
  velocity_.read(staging_);
  for (size_t i = 0; i < staging_.size(); ++i) {
    if (glm::vec3(staging_[i]) != state.velocity_mps[i]) is_changed[i % layout_.strand_count] = true;
  }
  for (size_t i = 0; i < staging_.size(); ++i) {
    const float kept = is_changed[i % layout_.strand_count] ? 0.0f : staging_[i].w;
    staging_[i] = glm::vec4(state.velocity_mps[i], kept);
  }
  velocity_.write(staging_);
  is_at_rest_ = is_at_rest_ && std::count(is_changed.begin(), is_changed.end(), true) == 0;
  return is_changed;
}

void StrandState::forget_model() {
  write_model(std::vector<float>(layout_.size(), 0.0f));
}

void StrandState::write_model(const std::vector<float>& values) {
  CHECK(values.size() == layout_.size());
  velocity_.read(staging_);
  for (size_t i = 0; i < staging_.size(); ++i) staging_[i].w = values[i];
  velocity_.write(staging_);
}

glm::dquat StrandState::rebase(const glm::dquat& world_from_head_rotation) {
  const glm::dquat turn = head_.rebase(world_from_head_rotation);
  turn_plane(position_, turn);
  turn_plane(velocity_, turn);
  return turn;
}

}  // namespace strandcast
