// Move-only GL objects, direct state access only, labelled for debuggers. All calls need a current context;
// the destructor needs the same one. No global state.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace strandcast::gl {

/// Owns one GL name and deletes it with Delete.
template <void (*Delete)(uint32_t)>
class Handle {
 public:
  Handle() = default;
  explicit Handle(uint32_t name) : name_(name) {}
  Handle(Handle&& other) noexcept : name_(std::exchange(other.name_, 0u)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~Handle() {
    if (name_ != 0) Delete(name_);
  }
  uint32_t name() const { return name_; }
  explicit operator bool() const { return name_ != 0; }

 private:
  uint32_t name_ = 0;
};

void delete_buffer(uint32_t name);
void delete_texture(uint32_t name);
void delete_framebuffer(uint32_t name);
void delete_program(uint32_t name);
void delete_vertex_array(uint32_t name);
void delete_query(uint32_t name);

/// Immutable-size storage; contents may be rewritten. A size of 0 makes an empty handle.
class Buffer {
 public:
  Buffer() = default;
  Buffer(const std::string& label, size_t size_bytes);
  Buffer(const std::string& label, std::span<const std::byte> bytes);

  template <class T>
  static Buffer of(const std::string& label, const std::vector<T>& values) {
    return Buffer(label, std::as_bytes(std::span(values)));
  }

  void write(size_t offset_bytes, std::span<const std::byte> bytes);
  template <class T>
  void write(const std::vector<T>& values) {
    write(0, std::as_bytes(std::span(values)));
  }
  /// Blocks until the GPU has written it.
  void read(size_t offset_bytes, std::span<std::byte> bytes) const;
  template <class T>
  std::vector<T> read_all() const {
    std::vector<T> values(size_bytes_ / sizeof(T));
    read(0, std::as_writable_bytes(std::span(values)));
    return values;
  }
  void bind_storage(uint32_t binding) const;
  void bind_storage_range(uint32_t binding, size_t offset_bytes, size_t size_bytes) const;
  void bind_uniform(uint32_t binding) const;

  uint32_t name() const { return handle_.name(); }
  size_t size_bytes() const { return size_bytes_; }

 private:
  Handle<delete_buffer> handle_;
  size_t size_bytes_ = 0;
};

/// 2-D colour or depth texture without mipmaps; nearest filter, clamped to its edge.
class Texture {
 public:
  Texture() = default;
  /// `samples` > 1 makes a multisample texture.
  Texture(const std::string& label, uint32_t internal_format, uint32_t width, uint32_t height,
          uint32_t samples);
  void bind(uint32_t unit) const;
  uint32_t name() const { return handle_.name(); }
  uint32_t width() const { return width_; }
  uint32_t height() const { return height_; }

 private:
  Handle<delete_texture> handle_;
  uint32_t width_ = 0;
  uint32_t height_ = 0;
};

/// Framebuffer over textures it does not own.
class Framebuffer {
 public:
  Framebuffer() = default;
  /// For textures that are known to be there; make() for sizes that somebody else chose.
  Framebuffer(const std::string& label, std::span<const Texture* const> colors, const Texture* depth);
  /// LimitExceeded when the driver cannot draw into the textures, which may be too large for it.
  static Result<Framebuffer> make(const std::string& label, std::span<const Texture* const> colors,
                                  const Texture* depth);
  /// 1 x 1 without storage: what to bind for transform feedback with the rasteriser off, since a context
  /// without a surface has no framebuffer of its own and refuses every draw.
  static Framebuffer without_attachments(const std::string& label);
  void bind() const;
  uint32_t name() const { return handle_.name(); }

 private:
  void attach(const std::string& label, std::span<const Texture* const> colors, const Texture* depth);
  bool is_complete() const;
  Handle<delete_framebuffer> handle_;
};

class VertexArray {
 public:
  VertexArray() = default;
  explicit VertexArray(const std::string& label);
  void bind() const;
  uint32_t name() const { return handle_.name(); }

 private:
  Handle<delete_vertex_array> handle_;
};

}  // namespace strandcast::gl
