#include "common/gl/objects.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <atomic>

#include "common/base/check.h"

namespace strandcast::gl {
namespace {

struct AtomicCounts {
  std::array<std::atomic<int64_t>, kObjectKindCount> objects{};
  std::atomic<int64_t> contexts{0};
  std::atomic<int64_t> size_bytes{0};
  std::atomic<int64_t> compiled_programs{0};
};

AtomicCounts& counts() {
  static AtomicCounts counts;
  return counts;
}

uint64_t read_count(const std::atomic<int64_t>& count) {
  return static_cast<uint64_t>(count.load(std::memory_order_relaxed));
}

/// Bytes of one sample as the driver stores it; 0 when the storage could not be had.
uint64_t sample_bytes(uint32_t texture) {
  constexpr int kByteBits = 8;
  uint64_t bits = 0;
  for (const GLenum part : {GL_TEXTURE_RED_SIZE, GL_TEXTURE_GREEN_SIZE, GL_TEXTURE_BLUE_SIZE,
                            GL_TEXTURE_ALPHA_SIZE, GL_TEXTURE_DEPTH_SIZE, GL_TEXTURE_STENCIL_SIZE}) {
    GLint part_bits = 0;
    glGetTextureLevelParameteriv(texture, 0, part, &part_bits);
    bits += static_cast<uint64_t>(std::max(part_bits, 0));
  }
  return bits / kByteBits;
}

void label_object(GLenum kind, uint32_t name, const std::string& label) {
  glObjectLabel(kind, name, static_cast<GLsizei>(label.size()), label.data());
}

uint32_t create_buffer(const std::string& label, size_t size_bytes, const void* bytes) {
  if (size_bytes == 0) return 0;
  GLuint name = 0;
  glCreateBuffers(1, &name);
  label_object(GL_BUFFER, name, label);
  glNamedBufferStorage(name, static_cast<GLsizeiptr>(size_bytes), bytes, GL_DYNAMIC_STORAGE_BIT);
  return name;
}

}  // namespace

const char* to_string(ObjectKind kind) {
  static constexpr std::array<const char*, kObjectKindCount> kNames = {
      "buffer", "texture", "framebuffer", "program", "vertex_array", "query"};
  return kNames[static_cast<size_t>(kind)];
}

ObjectCounts object_counts() {
  const AtomicCounts& now = counts();
  ObjectCounts copy;
  for (size_t kind = 0; kind < kObjectKindCount; ++kind) copy.objects[kind] = read_count(now.objects[kind]);
  copy.contexts = read_count(now.contexts);
  copy.size_bytes = read_count(now.size_bytes);
  copy.compiled_programs = read_count(now.compiled_programs);
  return copy;
}

void count_object(ObjectKind kind, int64_t difference, int64_t size_bytes) {
  counts().objects[static_cast<size_t>(kind)].fetch_add(difference, std::memory_order_relaxed);
  counts().size_bytes.fetch_add(size_bytes, std::memory_order_relaxed);
}

void count_context(int64_t difference) {
  counts().contexts.fetch_add(difference, std::memory_order_relaxed);
}

void count_compiled_program() {
  counts().compiled_programs.fetch_add(1, std::memory_order_relaxed);
}

void delete_buffer(uint32_t name) {
  glDeleteBuffers(1, &name);
}
void delete_texture(uint32_t name) {
  glDeleteTextures(1, &name);
}
void delete_framebuffer(uint32_t name) {
  glDeleteFramebuffers(1, &name);
}
void delete_program(uint32_t name) {
  glDeleteProgram(name);
}
void delete_vertex_array(uint32_t name) {
  glDeleteVertexArrays(1, &name);
}
void delete_query(uint32_t name) {
  glDeleteQueries(1, &name);
}

Buffer::Buffer(const std::string& label, size_t size_bytes)
    : handle_(create_buffer(label, size_bytes, nullptr), size_bytes), size_bytes_(size_bytes) {
  // Fresh storage is undefined and differs between drivers.
  if (handle_) glClearNamedBufferData(name(), GL_R8UI, GL_RED_INTEGER, GL_UNSIGNED_BYTE, nullptr);
}

Buffer::Buffer(const std::string& label, std::span<const std::byte> bytes)
    : handle_(create_buffer(label, bytes.size(), bytes.data()), bytes.size()), size_bytes_(bytes.size()) {}

void Buffer::write(size_t offset_bytes, std::span<const std::byte> bytes) {
  CHECK(offset_bytes <= size_bytes_ && bytes.size() <= size_bytes_ - offset_bytes);
  if (bytes.empty()) return;
  glNamedBufferSubData(name(), static_cast<GLintptr>(offset_bytes), static_cast<GLsizeiptr>(bytes.size()),
                       bytes.data());
}

void Buffer::read(size_t offset_bytes, std::span<std::byte> bytes) const {
  CHECK(offset_bytes <= size_bytes_ && bytes.size() <= size_bytes_ - offset_bytes);
  if (bytes.empty()) return;
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  glGetNamedBufferSubData(name(), static_cast<GLintptr>(offset_bytes), static_cast<GLsizeiptr>(bytes.size()),
                          bytes.data());
}

void Buffer::bind_storage(uint32_t binding) const {
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, name());
}

void Buffer::bind_uniform(uint32_t binding) const {
  glBindBufferBase(GL_UNIFORM_BUFFER, binding, name());
}

Texture::Texture(const std::string& label, uint32_t internal_format, uint32_t width, uint32_t height,
                 uint32_t samples)
    : width_(width), height_(height) {
  CHECK(width > 0 && height > 0);
  GLuint name = 0;
  const auto w = static_cast<GLsizei>(width);
  const auto h = static_cast<GLsizei>(height);
  if (samples > 1) {
    glCreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &name);
    glTextureStorage2DMultisample(name, static_cast<GLsizei>(samples), internal_format, w, h, GL_TRUE);
  } else {
    glCreateTextures(GL_TEXTURE_2D, 1, &name);
    glTextureStorage2D(name, 1, internal_format, w, h);
    // The default filters would make it incomplete: no mipmaps, and integer formats cannot be filtered.
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  }
  label_object(GL_TEXTURE, name, label);
  handle_ =
      Handle<delete_texture>(name, uint64_t{width} * height * std::max(samples, 1u) * sample_bytes(name));
}

Texture Texture::volume(const std::string& label, uint32_t internal_format, uint32_t width, uint32_t height,
                        uint32_t depth) {
  CHECK(width > 0 && height > 0 && depth > 0);
  Texture texture;
  texture.width_ = width;
  texture.height_ = height;
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_3D, 1, &name);
  glTextureStorage3D(name, 1, internal_format, static_cast<GLsizei>(width), static_cast<GLsizei>(height),
                     static_cast<GLsizei>(depth));
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    glTextureParameteri(name, axis, GL_CLAMP_TO_EDGE);
  label_object(GL_TEXTURE, name, label);
  texture.handle_ = Handle<delete_texture>(name, uint64_t{width} * height * depth * sample_bytes(name));
  return texture;
}

Texture Texture::view_of(const std::string& label, uint32_t internal_format, const Buffer& buffer) {
  Texture texture;
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_BUFFER, 1, &name);
  glTextureBuffer(name, internal_format, buffer.name());
  label_object(GL_TEXTURE, name, label);
  texture.handle_ = Handle<delete_texture>(name);
  return texture;
}

void Texture::bind(uint32_t unit) const {
  glBindTextureUnit(unit, name());
}

Framebuffer::Framebuffer(const std::string& label, std::span<const Texture* const> colors,
                         const Texture* depth) {
  attach(label, colors, depth);
  CHECK(is_complete());
}

Result<Framebuffer> Framebuffer::make(const std::string& label, std::span<const Texture* const> colors,
                                      const Texture* depth) {
  Framebuffer framebuffer;
  framebuffer.attach(label, colors, depth);
  if (framebuffer.is_complete()) return framebuffer;
  const Texture* first = colors.empty() ? depth : colors.front();
  return make_error(ErrorCode::LimitExceeded,
                    "OpenGL cannot draw into the {} of {} x {} pixels, which may be too many for this driver",
                    label, first ? first->width() : 0, first ? first->height() : 0);
}

void Framebuffer::attach(const std::string& label, std::span<const Texture* const> colors,
                         const Texture* depth) {
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  label_object(GL_FRAMEBUFFER, name, label);
  handle_ = Handle<delete_framebuffer>(name);
  std::vector<GLenum> draw_buffers;
  for (const Texture* color : colors) {
    const auto attachment = static_cast<GLenum>(GL_COLOR_ATTACHMENT0 + draw_buffers.size());
    glNamedFramebufferTexture(name, attachment, color->name(), 0);
    draw_buffers.push_back(attachment);
  }
  if (draw_buffers.empty()) draw_buffers.push_back(GL_NONE);
  glNamedFramebufferDrawBuffers(name, static_cast<GLsizei>(draw_buffers.size()), draw_buffers.data());
  if (depth != nullptr) glNamedFramebufferTexture(name, GL_DEPTH_ATTACHMENT, depth->name(), 0);
  if (colors.empty() && depth == nullptr) {
    glNamedFramebufferParameteri(name, GL_FRAMEBUFFER_DEFAULT_WIDTH, 1);
    glNamedFramebufferParameteri(name, GL_FRAMEBUFFER_DEFAULT_HEIGHT, 1);
  }
}

bool Framebuffer::is_complete() const {
  return glCheckNamedFramebufferStatus(name(), GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

Framebuffer Framebuffer::without_attachments(const std::string& label, uint32_t width, uint32_t height) {
  Framebuffer framebuffer(label, {}, nullptr);
  glNamedFramebufferParameteri(framebuffer.name(), GL_FRAMEBUFFER_DEFAULT_WIDTH, static_cast<GLint>(width));
  glNamedFramebufferParameteri(framebuffer.name(), GL_FRAMEBUFFER_DEFAULT_HEIGHT, static_cast<GLint>(height));
  return framebuffer;
}

void Framebuffer::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, name());
}

VertexArray::VertexArray(const std::string& label) {
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  label_object(GL_VERTEX_ARRAY, name, label);
  handle_ = Handle<delete_vertex_array>(name);
}

void VertexArray::bind() const {
  glBindVertexArray(name());
}

}  // namespace strandcast::gl
