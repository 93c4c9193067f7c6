#include <meshoptimizer.h>

#include <cstring>

#include "common/strands/zstd_block.h"
#include "server/report/peers/integer_coder.h"

namespace strandcast {
namespace {

constexpr int kMeshoptLevel = 3;
constexpr size_t kMaxEncodedBytes = size_t{1} << 28;

/// A vertex as the codec takes it: a multiple of four bytes. Half of 16 bits is added, so that small numbers
/// of either sign have the same upper byte.
struct NarrowVertex {
  uint16_t axis[4];
};
struct WideVertex {
  uint32_t axis[3];
};
constexpr int32_t kHalf = 1 << 15;
constexpr int32_t kSmallHalf = 1 << 7;  // residuals: the lower byte does not wrap around zero

class MeshoptCoder final : public IntegerCoder {
 public:
  Result<std::vector<std::byte>> encode(const IntegerPlanes& planes, IntegerKind) override {
    bool is_narrow = true;
    for (const int32_t value : planes.value)
      is_narrow = is_narrow && value >= -kHalf && value < kHalf - kSmallHalf;
    return is_narrow ? encode_as<NarrowVertex>(planes) : encode_as<WideVertex>(planes);
  }

  Result<IntegerPlanes> decode(std::span<const std::byte> bytes, uint32_t strand_count,
                               uint32_t vertex_count) override {
    if (bytes.size() < sizeof(uint8_t)) return make_error(ErrorCode::BadInput, "the message is empty");
    const std::span<const std::byte> packed = bytes.subspan(1);
    ASSIGN_OR_RETURN(const size_t size, zstd_content_bytes(packed, kMaxEncodedBytes));
    buffer_.resize(size);
    RETURN_IF_ERROR(decompressor_.fill(packed, std::as_writable_bytes(std::span(buffer_))));
    return bytes[0] == std::byte{sizeof(NarrowVertex)} ? decode_as<NarrowVertex>(strand_count, vertex_count)
                                                       : decode_as<WideVertex>(strand_count, vertex_count);
  }

 private:
  // Strand by strand from the root on: the codec takes differences of successive vertices.
  template <class Vertex>
  Result<std::vector<std::byte>> encode_as(const IntegerPlanes& planes) {
    std::vector<Vertex> vertices(planes.plane_size(), Vertex{});
    size_t place = 0;
    for (size_t strand = 0; strand < planes.strand_count; ++strand)
      for (size_t vertex = 0; vertex < planes.vertex_count; ++vertex, ++place)
        for (size_t axis = 0; axis < 3; ++axis) {
          const int32_t value =
              planes.value[axis * planes.plane_size() + vertex * planes.strand_count + strand];
          vertices[place].axis[axis] =
              static_cast<std::remove_reference_t<decltype(Vertex::axis[0])>>(value + kHalf + kSmallHalf);
        }
    buffer_.resize(meshopt_encodeVertexBufferBound(vertices.size(), sizeof(Vertex)));
    const size_t size = meshopt_encodeVertexBuffer(buffer_.data(), buffer_.size(), vertices.data(),
                                                   vertices.size(), sizeof(Vertex));
    if (size == 0) return make_error(ErrorCode::Internal, "meshoptimizer did not encode");
    std::vector<std::byte> bytes{std::byte{sizeof(Vertex)}};
    compressor_.append(std::as_bytes(std::span(buffer_).first(size)), kMeshoptLevel, bytes);
    return bytes;
  }

  template <class Vertex>
  Result<IntegerPlanes> decode_as(uint32_t strand_count, uint32_t vertex_count) {
    IntegerPlanes planes = IntegerPlanes::make(strand_count, vertex_count);
    std::vector<Vertex> vertices(planes.plane_size());
    if (meshopt_decodeVertexBuffer(vertices.data(), vertices.size(), sizeof(Vertex), buffer_.data(),
                                   buffer_.size()) != 0)
      return make_error(ErrorCode::BadInput, "meshoptimizer refuses the message");
    size_t place = 0;
    for (size_t strand = 0; strand < planes.strand_count; ++strand)
      for (size_t vertex = 0; vertex < planes.vertex_count; ++vertex, ++place)
        for (size_t axis = 0; axis < 3; ++axis)
          planes.value[axis * planes.plane_size() + vertex * planes.strand_count + strand] =
              static_cast<int32_t>(vertices[place].axis[axis]) - kHalf - kSmallHalf;
    return planes;
  }

  ZstdCompressor compressor_;
  ZstdDecompressor decompressor_;
  std::vector<unsigned char> buffer_;
};

}  // namespace

std::unique_ptr<IntegerCoder> make_meshopt_coder() {
  return std::make_unique<MeshoptCoder>();
}

}  // namespace strandcast
