#include <draco/compression/decode.h>
#include <draco/compression/encode.h>

#include <array>

#include "server/report/peers/integer_coder.h"

namespace strandcast {
namespace {

using draco::AttributeValueIndex;
using draco::GeometryAttribute;

class DracoCoder final : public IntegerCoder {
 public:
  // Strand by strand from the root on: positions are coded as differences of successive points.
  Result<std::vector<std::byte>> encode(const IntegerPlanes& planes, IntegerKind kind) override {
    const auto point_count = static_cast<uint32_t>(planes.plane_size());
    draco::PointCloud cloud;
    cloud.set_num_points(point_count);
    GeometryAttribute attribute;
    attribute.Init(GeometryAttribute::GENERIC, nullptr, 3, draco::DT_INT32, false, 3 * sizeof(int32_t), 0);
    const int id = cloud.AddAttribute(attribute, true, point_count);
    uint32_t place = 0;
    for (size_t strand = 0; strand < planes.strand_count; ++strand)
      for (size_t vertex = 0; vertex < planes.vertex_count; ++vertex, ++place) {
        std::array<int32_t, 3> point{};
        for (size_t axis = 0; axis < 3; ++axis)
          point[axis] = planes.value[axis * planes.plane_size() + vertex * planes.strand_count + strand];
        cloud.attribute(id)->SetAttributeValue(AttributeValueIndex(place), point.data());
      }

    draco::Encoder encoder;
    encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
    const auto prediction =
        kind == IntegerKind::Positions ? draco::PREDICTION_DIFFERENCE : draco::PREDICTION_NONE;
    if (!encoder.SetAttributePredictionScheme(GeometryAttribute::GENERIC, prediction).ok())
      return make_error(ErrorCode::Internal, "Draco refuses the prediction scheme");
    draco::EncoderBuffer buffer;
    const draco::Status status = encoder.EncodePointCloudToBuffer(cloud, &buffer);
    if (!status.ok()) return make_error(ErrorCode::Internal, "Draco: {}", status.error_msg_string());
    const auto bytes = std::as_bytes(std::span(buffer.data(), buffer.size()));
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  }

  Result<IntegerPlanes> decode(std::span<const std::byte> bytes, uint32_t strand_count,
                               uint32_t vertex_count) override {
    IntegerPlanes planes = IntegerPlanes::make(strand_count, vertex_count);
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodePointCloudFromBuffer(&buffer);
    if (!decoded.ok())
      return make_error(ErrorCode::BadInput, "Draco: {}", decoded.status().error_msg_string());
    const draco::PointCloud& cloud = *decoded.value();
    if (cloud.num_points() != planes.plane_size() || cloud.num_attributes() != 1 ||
        cloud.attribute(0)->num_components() != 3 || cloud.attribute(0)->data_type() != draco::DT_INT32)
      return make_error(ErrorCode::BadInput, "Draco: a point cloud of another shape");
    uint32_t place = 0;
    for (size_t strand = 0; strand < planes.strand_count; ++strand)
      for (size_t vertex = 0; vertex < planes.vertex_count; ++vertex, ++place) {
        std::array<int32_t, 3> point{};
        cloud.attribute(0)->GetMappedValue(draco::PointIndex(place), point.data());
        for (size_t axis = 0; axis < 3; ++axis)
          planes.value[axis * planes.plane_size() + vertex * planes.strand_count + strand] = point[axis];
      }
    return planes;
  }
};

}  // namespace

std::unique_ptr<IntegerCoder> make_draco_coder() {
  return std::make_unique<DracoCoder>();
}

}  // namespace strandcast
