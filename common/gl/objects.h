// Move-only owners of GL objects, using direct state access only and labelled for debuggers. All calls need a
// current context; the destructor needs the same one. Only the counts of objects are global.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace strandcast::gl {

enum class ObjectKind : uint8_t { Buffer, Texture, Framebuffer, Program, VertexArray, Query };
inline constexpr size_t kObjectKindCount = 6;
/// Returns the name of a kind for printing and metrics, for example "buffer" or "vertex_array".
const char* to_string(ObjectKind kind);

/// GL objects and bytes that this process holds in all contexts.
struct ObjectCounts {
  std::array<uint64_t, kObjectKindCount> objects{};  // by kind
  uint64_t contexts = 0;
  uint64_t size_bytes = 0;         // storage of buffers and textures
  uint64_t compiled_programs = 0;  // since the process began

  uint64_t of(ObjectKind kind) const { return objects[static_cast<size_t>(kind)]; }
  bool operator==(const ObjectCounts&) const = default;
};
/// Returns the current counts; any thread, no context needed.
ObjectCounts object_counts();
/// Change the counts when an object, context or program is made (+1) or destroyed (-1).
void count_object(ObjectKind kind, int64_t difference, int64_t size_bytes);
void count_context(int64_t difference);
void count_compiled_program();

void delete_buffer(uint32_t name);
void delete_texture(uint32_t name);
void delete_framebuffer(uint32_t name);
void delete_program(uint32_t name);
void delete_vertex_array(uint32_t name);
void delete_query(uint32_t name);

template <void (*Delete)(uint32_t)>
inline constexpr ObjectKind kKindOf = ObjectKind::Buffer;
template <>
inline constexpr ObjectKind kKindOf<delete_texture> = ObjectKind::Texture;
template <>
inline constexpr ObjectKind kKindOf<delete_framebuffer> = ObjectKind::Framebuffer;
template <>
inline constexpr ObjectKind kKindOf<delete_program> = ObjectKind::Program;
template <>
inline constexpr ObjectKind kKindOf<delete_vertex_array> = ObjectKind::VertexArray;
template <>
inline constexpr ObjectKind kKindOf<delete_query> = ObjectKind::Query;

/// Owns one GL name and deletes it with the function Delete.
template <void (*Delete)(uint32_t)>
class Handle {
 public:
  Handle() = default;
  /// Takes over `name`; `size_bytes` is the size of its storage, for the counts.
  explicit Handle(uint32_t name, uint64_t size_bytes = 0) : name_(name), size_bytes_(size_bytes) {
    if (name_ != 0) count_object(kKindOf<Delete>, 1, static_cast<int64_t>(size_bytes_));
  }
  Handle(Handle&& other) noexcept
      : name_(std::exchange(other.name_, 0u)), size_bytes_(std::exchange(other.size_bytes_, 0u)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(name_, other.name_);
    std::swap(size_bytes_, other.size_bytes_);
    return *this;
  }
  ~Handle() {
    if (name_ == 0) return;
    Delete(name_);
    count_object(kKindOf<Delete>, -1, -static_cast<int64_t>(size_bytes_));
  }
  uint32_t name() const { return name_; }
  uint64_t size_bytes() const { return size_bytes_; }
  explicit operator bool() const { return name_ != 0; }

 private:
  uint32_t name_ = 0;
  uint64_t size_bytes_ = 0;
};

/// Buffer whose size is fixed and whose contents may be rewritten. A size of 0 makes an empty handle.
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
  /// Copies bytes from the buffer; blocks until the GPU has written them.
  void read(size_t offset_bytes, std::span<std::byte> bytes) const;
  template <class T>
  std::vector<T> read_all() const {
    std::vector<T> values(size_bytes_ / sizeof(T));
    read(0, std::as_writable_bytes(std::span(values)));
    return values;
  }
  void bind_storage(uint32_t binding) const;
  void bind_uniform(uint32_t binding) const;

  uint32_t name() const { return handle_.name(); }
  size_t size_bytes() const { return size_bytes_; }

 private:
  Handle<delete_buffer> handle_;
  size_t size_bytes_ = 0;
};

/// 2-D colour or depth texture without mipmaps and with nearest filtering, or 3-D texture with linear
/// filtering. Clamped to its edges.
class Texture {
 public:
  Texture() = default;
  /// Makes a 2-D texture; `samples` > 1 makes it multisampled.
  Texture(const std::string& label, uint32_t internal_format, uint32_t width, uint32_t height,
          uint32_t samples);
  static Texture volume(const std::string& label, uint32_t internal_format, uint32_t width, uint32_t height,
                        uint32_t depth);
  /// Makes a texture that views a buffer, with texels of `internal_format`. The buffer must outlive it.
  static Texture view_of(const std::string& label, uint32_t internal_format, const Buffer& buffer);
  void bind(uint32_t unit) const;
  uint32_t name() const { return handle_.name(); }
  uint64_t size_bytes() const { return handle_.size_bytes(); }
  uint32_t width() const { return width_; }
  uint32_t height() const { return height_; }

 private:
  Handle<delete_texture> handle_;
  uint32_t width_ = 0;
  uint32_t height_ = 0;
};

/// Framebuffer over textures that it does not own.
class Framebuffer {
 public:
  Framebuffer() = default;
  /// Makes a framebuffer over textures that are known to be usable; use make() for sizes chosen from outside.
  Framebuffer(const std::string& label, std::span<const Texture* const> colors, const Texture* depth);
  /// Makes a framebuffer; LimitExceeded if the driver cannot draw into the textures, which may be too large
  /// for it.
  static Result<Framebuffer> make(const std::string& label, std::span<const Texture* const> colors,
                                  const Texture* depth);
  /// Makes a framebuffer without attachments, by default of 1 x 1 pixels. A context without a surface has no
  /// default framebuffer and refuses every draw, even transform feedback with the rasteriser off. Larger
  /// sizes serve draws that write into buffers.
  static Framebuffer without_attachments(const std::string& label, uint32_t width = 1, uint32_t height = 1);
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
