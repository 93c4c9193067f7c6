#include <zfp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "common/base/check.h"
#include "server/report/peers/frame_order.h"
#include "server/report/peers/peer_codecs.h"

namespace strandcast {
namespace {

// The search for the tolerance begins here, in powers of two above the bound; zfp keeps well within it.
constexpr int kTolerancePowersAbove = 4;
constexpr int kMostPowers = 20;
constexpr size_t kZfpSampledStrands = 8;  // one in so many is looked at for the weights
// Keep the system solvable when nothing moves, and when nothing has moved before: relative, and in m2.
constexpr double kZfpRidge = 1e-6;
constexpr double kLeastRidgeM2 = 1e-18;

/// Axis-major, then vertex, strand fastest, as integer planes.
using FloatPlanes = std::vector<float>;

struct StreamCloser {
  void operator()(zfp_stream* stream) const { zfp_stream_close(stream); }
};
struct BitsCloser {
  void operator()(bitstream* bits) const { stream_close(bits); }
};
struct FieldCloser {
  void operator()(zfp_field* field) const { zfp_field_free(field); }
};

/// The three axes one after the other in one zfp stream.
class ZfpPlanes {
 public:
  explicit ZfpPlanes(const StreamShape& shape)
      : strand_count_(shape.strand_count), vertex_count_(shape.vertex_count) {}

  Result<std::vector<std::byte>> compressed(FloatPlanes planes, double tolerance_m) const {
    const Open zfp = open(planes, tolerance_m);
    std::vector<std::byte> bytes(3 * zfp_stream_maximum_size(zfp.stream.get(), zfp.field.get()));
    const std::unique_ptr<bitstream, BitsCloser> bits(stream_open(bytes.data(), bytes.size()));
    zfp_stream_set_bit_stream(zfp.stream.get(), bits.get());
    zfp_stream_rewind(zfp.stream.get());
    size_t size = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      zfp_field_set_pointer(zfp.field.get(), planes.data() + axis * planes.size() / 3);
      size = zfp_compress(zfp.stream.get(), zfp.field.get());
      if (size == 0) return make_error(ErrorCode::Internal, "zfp did not encode");
    }
    bytes.resize(size);
    return bytes;
  }

  Result<FloatPlanes> decompressed(std::vector<std::byte> bytes, double tolerance_m) const {
    FloatPlanes planes(size_t{3} * strand_count_ * vertex_count_);
    const Open zfp = open(planes, tolerance_m);
    const std::unique_ptr<bitstream, BitsCloser> bits(stream_open(bytes.data(), bytes.size()));
    zfp_stream_set_bit_stream(zfp.stream.get(), bits.get());
    zfp_stream_rewind(zfp.stream.get());
    for (size_t axis = 0; axis < 3; ++axis) {
      zfp_field_set_pointer(zfp.field.get(), planes.data() + axis * planes.size() / 3);
      if (zfp_decompress(zfp.stream.get(), zfp.field.get()) == 0)
        return make_error(ErrorCode::BadInput, "zfp refuses the message");
    }
    return planes;
  }

 private:
  struct Open {
    std::unique_ptr<zfp_stream, StreamCloser> stream;
    std::unique_ptr<zfp_field, FieldCloser> field;
  };
  Open open(FloatPlanes& planes, double tolerance_m) const {
    Open zfp{std::unique_ptr<zfp_stream, StreamCloser>(zfp_stream_open(nullptr)),
             std::unique_ptr<zfp_field, FieldCloser>(
                 zfp_field_2d(planes.data(), zfp_type_float, strand_count_, vertex_count_))};
    zfp_stream_set_accuracy(zfp.stream.get(), tolerance_m);
    return zfp;
  }

  size_t strand_count_;
  size_t vertex_count_;
};

/// The last movement and its change, weighted; of decoded positions, so that errors do not add up.
class FloatPredictor {
 public:
  std::array<float, 2> fit(const FloatPlanes& now) const {
    if (last_.empty()) return {};
    glm::dmat2 system(kLeastRidgeM2);
    glm::dvec2 side(0.0);
    for (size_t i = 0; i < now.size(); i += kZfpSampledStrands) {
      const glm::dvec2 feature(movement_[i], movement_[i] - movement_before_[i]);
      system += glm::outerProduct(feature, feature);
      side += feature * static_cast<double>(now[i] - last_[i]);
    }
    system += glm::dmat2(kZfpRidge * (system[0][0] + system[1][1]));
    const glm::dvec2 solution = glm::inverse(system) * side;
    return {static_cast<float>(solution.x), static_cast<float>(solution.y)};
  }
  FloatPlanes prediction(const std::array<float, 2>& weights, size_t size) const {
    if (last_.empty()) return FloatPlanes(size, 0.0f);
    FloatPlanes result(size);
    for (size_t i = 0; i < size; ++i)
      result[i] = last_[i] + (weights[0] * movement_[i] + weights[1] * (movement_[i] - movement_before_[i]));
    return result;
  }
  void advance(const FloatPlanes& now) {
    if (last_.empty()) {
      movement_.assign(now.size(), 0.0f);
      movement_before_ = movement_;
    } else {
      movement_before_.swap(movement_);
      for (size_t i = 0; i < now.size(); ++i) movement_[i] = now[i] - last_[i];
    }
    last_ = now;
  }

 private:
  FloatPlanes last_;
  FloatPlanes movement_;
  FloatPlanes movement_before_;
};

FloatPlanes sum(FloatPlanes a, const FloatPlanes& b) {
  for (size_t i = 0; i < a.size(); ++i) a[i] += b[i];
  return a;
}

FloatPlanes difference(FloatPlanes a, const FloatPlanes& b) {
  for (size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
  return a;
}

double largest_distance_m(const FloatPlanes& a, const FloatPlanes& b) {
  const size_t plane_size = a.size() / 3;
  double largest = 0.0;
  for (size_t i = 0; i < plane_size; ++i) {
    glm::dvec3 off;
    for (size_t axis = 0; axis < 3; ++axis)
      off[static_cast<int>(axis)] =
          static_cast<double>(a[axis * plane_size + i]) - static_cast<double>(b[axis * plane_size + i]);
    // What is not a number is beyond every bound.
    largest = std::max(largest, std::isnan(glm::dot(off, off)) ? INFINITY : glm::dot(off, off));
  }
  return std::sqrt(largest);
}

class ZfpPeer final : public StreamCodec {
 public:
  ZfpPeer(double bound_m, PeerPrediction prediction, const StreamShape& shape)
      : bound_m_(bound_m),
        prediction_(prediction),
        order_(shape),
        zfp_(shape),
        planes_(3 * shape.plane_size()),
        tolerance_m_(std::exp2(std::floor(std::log2(bound_m)) + kTolerancePowersAbove)) {}

  Status take(const StreamFrame& frame) override {
    const std::vector<glm::vec3> sorted_m = order_.sorted(frame.position_in_head_m);
    for (size_t i = 0; i < sorted_m.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        planes_[static_cast<size_t>(axis) * sorted_m.size() + i] = sorted_m[i][axis];
    const FloatPlanes predicted = encoder_.prediction(fitted(), planes_.size());
    const FloatPlanes residual = difference(planes_, predicted);
    for (int i = 0; i < kMostPowers; ++i) {
      ASSIGN_OR_RETURN(std::vector<std::byte> bytes, zfp_.compressed(residual, tolerance_m_));
      ASSIGN_OR_RETURN(FloatPlanes back, zfp_.decompressed(std::move(bytes), tolerance_m_));
      if (largest_distance_m(sum(std::move(back), predicted), planes_) <= bound_m_) return {};
      tolerance_m_ *= 0.5;
    }
    return make_error(ErrorCode::Unsupported, "zfp cannot keep {} mm", bound_m_ * 1e3);
  }

  Result<std::vector<std::byte>> encode() override {
    Head head{fitted(), tolerance_m_};
    const FloatPlanes predicted = encoder_.prediction(head.weights, planes_.size());
    ASSIGN_OR_RETURN(std::vector<std::byte> message,
                     zfp_.compressed(difference(planes_, predicted), tolerance_m_));
    if (prediction_ == PeerPrediction::Temporal) {
      ASSIGN_OR_RETURN(FloatPlanes back, zfp_.decompressed(message, tolerance_m_));
      encoder_.advance(sum(std::move(back), predicted));
    }
    const auto bytes = std::as_bytes(std::span(&head, 1));
    message.insert(message.begin(), bytes.begin(), bytes.end());
    return message;
  }

  Status decode(std::span<const std::byte> message) override {
    Head head;
    if (message.size() < sizeof(head)) return make_error(ErrorCode::BadInput, "the message is too short");
    std::memcpy(&head, message.data(), sizeof(head));
    const auto body = message.subspan(sizeof(head));
    ASSIGN_OR_RETURN(FloatPlanes back, zfp_.decompressed({body.begin(), body.end()}, head.tolerance_m));
    decoded_ = sum(std::move(back), decoder_.prediction(head.weights, planes_.size()));
    if (prediction_ == PeerPrediction::Temporal) decoder_.advance(decoded_);
    return {};
  }

  std::vector<glm::vec3> decoded() const override {
    const size_t plane_size = decoded_.size() / 3;
    std::vector<glm::vec3> sorted(plane_size);
    for (size_t i = 0; i < plane_size; ++i)
      sorted[i] = {decoded_[i], decoded_[plane_size + i], decoded_[2 * plane_size + i]};
    return order_.restored(sorted);
  }

  Result<size_t> join_bytes(const StreamFrame& frame) override {
    encoder_ = {};
    decoder_ = {};
    RETURN_IF_ERROR(take(frame));
    ASSIGN_OR_RETURN(const std::vector<std::byte> message, encode());
    RETURN_IF_ERROR(decode(message));
    return message.size();
  }

 private:
  struct Head {
    std::array<float, 2> weights{};
    double tolerance_m = 0.0;
  };

  std::array<float, 2> fitted() const {
    return prediction_ == PeerPrediction::Temporal ? encoder_.fit(planes_) : std::array<float, 2>{};
  }

  double bound_m_;
  PeerPrediction prediction_;
  FrameOrder order_;
  ZfpPlanes zfp_;
  FloatPlanes planes_;
  FloatPlanes decoded_;
  FloatPredictor encoder_;
  FloatPredictor decoder_;
  double tolerance_m_;
};

}  // namespace

std::unique_ptr<StreamCodec> make_zfp_peer(double bound_m, PeerPrediction prediction,
                                           const StreamShape& shape) {
  CHECK(bound_m > 0.0);
  return std::make_unique<ZfpPeer>(bound_m, prediction, shape);
}

}  // namespace strandcast
