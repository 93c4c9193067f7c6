#include "server/input/live/natnet_frame.h"

#include <algorithm>

#include "common/base/text.h"
#include "common/strands/byte_io.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr size_t kMaxNatnetNameBytes = 256;  // with its NUL
constexpr size_t kPositionBytes = 3 * sizeof(float);
constexpr size_t kRotationBytes = 4 * sizeof(float);
constexpr size_t kCalibrationBytes = 12 * 12 * sizeof(float);
constexpr size_t kCornersBytes = 4 * kPositionBytes;

/// The section of `count` items of at least one byte each: a count that is too large ends at the last byte.
class NatnetReader : public ByteReader {
 public:
  using ByteReader::ByteReader;

  void skip(uint64_t count, size_t item_bytes) {
    // So many items of any size cannot lie in a datagram, and the product stays far below 64 bits.
    (void)take_bytes(static_cast<size_t>(count * item_bytes));
  }
  /// A name with its NUL; cut to what a subject may have.
  std::string take_name() {
    const auto bytes = rest();
    const auto end = std::find(bytes.begin(), bytes.end(), std::byte{0});
    const auto length = static_cast<size_t>(end - bytes.begin());
    if (end == bytes.end() || length >= kMaxNatnetNameBytes) {
      (void)take_bytes(bytes.size() + 1);  // remembers that there is none
      return {};
    }
    const auto taken = take_bytes(length + 1).first(length);
    return one_line({reinterpret_cast<const char*>(taken.data()), length}, kMaxSubjectBytes);
  }
  template <class ReadItem>
  void take_items(ReadItem read_item) {
    const auto count = take<uint32_t>();
    for (uint32_t i = 0; i < count && ok(); ++i) read_item();
  }
  void skip_names() {
    take_items([this] { (void)take_name(); });
  }
  bool is_done() const { return ok() && rest().empty(); }
};

NatnetBody take_body(NatnetReader& reader, NatnetVersion version) {
  NatnetBody body;
  body.id = reader.take<uint32_t>();
  for (int axis = 0; axis < 3; ++axis) body.position_m[axis] = reader.take<float>();
  for (int k = 0; k < 4; ++k) body.rotation_xyzw[k] = reader.take<float>();
  if (version < kNatnetWithoutMarkers)  // of each its place, number and size
    reader.skip(reader.take<uint32_t>(), kPositionBytes + sizeof(uint32_t) + sizeof(float));
  (void)reader.take<float>();  // mean error
  constexpr uint16_t kTracked = 1;
  body.is_tracked = version < kNatnetWithTracking || (reader.take<uint16_t>() & kTracked) != 0;
  return body;
}

/// Number, place and size; then flags, then how far off it is.
constexpr size_t labelled_marker_bytes(NatnetVersion version) {
  return sizeof(uint32_t) + kPositionBytes + sizeof(float) +
         (version < kNatnetWithTracking ? 0 : sizeof(uint16_t)) +
         (version < kNatnetWithoutMarkers ? 0 : sizeof(float));
}

class FrameReader {
 public:
  FrameReader(std::span<const std::byte> payload, NatnetVersion version)
      : reader_(payload), version_(version), is_sized_(version >= kNatnetSized) {}

  std::optional<NatnetFrame> read() {
    frame_.number = reader_.take<uint32_t>();
    read_section([](NatnetReader& r) {  // marker sets
      (void)r.take_name();
      r.skip(r.take<uint32_t>(), kPositionBytes);
    });
    read_section([](NatnetReader& r) { r.skip(1, kPositionBytes); });  // markers of nobody
    read_section([this](NatnetReader& r) { frame_.bodies.push_back(take_body(r, version_)); });
    read_section([this](NatnetReader& r) {
      const auto skeleton = r.take<uint32_t>();
      r.take_items([&] {
        frame_.bodies.push_back(take_body(r, version_));
        frame_.bodies.back().skeleton = skeleton;
      });
    });
    const size_t marker_bytes = labelled_marker_bytes(version_);
    if (is_sized_)
      read_section([&](NatnetReader& r) {  // assets
        (void)r.take<uint32_t>();
        r.take_items([&] { (void)take_body(r, version_); });
        r.skip(r.take<uint32_t>(), marker_bytes);
      });
    read_section([&](NatnetReader& r) { r.skip(1, marker_bytes); });
    if (version_ >= kNatnetWithPlates) read_section(skip_channels);
    if (version_ >= kNatnetWithDevices) read_section(skip_channels);
    read_end();
    if (!is_fit_ || !reader_.is_done()) return std::nullopt;
    return std::move(frame_);
  }

 private:
  template <class ReadItem>
  void read_section(ReadItem read_item) {
    const auto count = reader_.take<uint32_t>();
    if (!is_sized_) {
      for (uint32_t i = 0; i < count && reader_.ok(); ++i) read_item(reader_);
      return;
    }
    NatnetReader section(reader_.take_bytes(reader_.take<uint32_t>()));
    for (uint32_t i = 0; i < count && section.ok(); ++i) read_item(section);
    is_fit_ = is_fit_ && section.is_done();
  }

  static void skip_channels(NatnetReader& reader) {
    (void)reader.take<uint32_t>();
    reader.take_items([&] { reader.skip(reader.take<uint32_t>(), sizeof(float)); });
  }

  void read_end() {
    const bool has_ticks = version_ >= kNatnetWithoutMarkers;
    if (!has_ticks) (void)reader_.take<float>();  // latency
    reader_.skip(2, sizeof(uint32_t));            // time code
    if (version_ >= kNatnetWithDoubleTime)
      frame_.time_s = reader_.take<double>();
    else if (version_ >= kNatnetWithTracking)
      frame_.time_s = fine_seconds(reader_.take<float>());
    if (has_ticks) reader_.skip(3, sizeof(uint64_t));  // exposure, arrival and sending of the server
    if (is_sized_) reader_.skip(2, sizeof(uint32_t));
    constexpr uint16_t kNewModels = 2;
    if (version_ >= kNatnetWithTracking) frame_.has_new_models = (reader_.take<uint16_t>() & kNewModels) != 0;
    (void)reader_.take<uint32_t>();  // end of data
  }

  NatnetReader reader_;
  NatnetVersion version_;
  bool is_sized_;
  bool is_fit_ = true;
  NatnetFrame frame_;
};

enum DescriptionKind : uint32_t { kMarkerSet, kRigidBody, kSkeleton, kForcePlate, kDevice, kCamera };

/// The name and the number of a body; what follows them is skipped as this version has it.
NatnetName take_body_name(NatnetReader& reader, NatnetVersion version) {
  NatnetName body;
  body.name = reader.take_name();
  body.id = reader.take<uint32_t>();
  reader.skip(1, sizeof(uint32_t) + kPositionBytes);  // parent, offset
  if (version < kNatnetWithoutMarkers) return body;
  const bool has_marker_names = version >= kNatnetWithMarkerNames;
  const auto marker_count = reader.take<uint32_t>();
  reader.skip(marker_count, kPositionBytes + sizeof(uint32_t));
  for (uint32_t i = 0; has_marker_names && i < marker_count && reader.ok(); ++i) (void)reader.take_name();
  return body;
}

void take_skeleton_names(NatnetReader& reader, NatnetVersion version, std::vector<NatnetName>& names) {
  NatnetName skeleton;
  skeleton.name = reader.take_name();
  skeleton.skeleton = reader.take<uint32_t>();
  names.push_back(skeleton);
  reader.take_items([&] {
    NatnetName bone = take_body_name(reader, version);
    bone.skeleton = skeleton.skeleton;
    names.push_back(std::move(bone));
  });
}

/// A description without anything that is of use here; false for a kind that is not known.
bool skip_description(uint32_t kind, NatnetReader& reader) {
  switch (kind) {
    case kMarkerSet:
      (void)reader.take_name();
      reader.skip_names();
      return true;
    case kForcePlate:
      (void)reader.take<uint32_t>();
      (void)reader.take_name();
      reader.skip(
          1, 2 * sizeof(float) + kPositionBytes + kCalibrationBytes + kCornersBytes + 2 * sizeof(uint32_t));
      reader.skip_names();
      return true;
    case kDevice:
      (void)reader.take<uint32_t>();
      (void)reader.take_name();
      (void)reader.take_name();
      reader.skip(2, sizeof(uint32_t));
      reader.skip_names();
      return true;
    case kCamera:
      (void)reader.take_name();
      reader.skip(1, kPositionBytes + kRotationBytes);
      return true;
    default:
      return false;
  }
}

/// Later versions add to the end of descriptions: where their sizes are told, what does not fit is left out.
void take_sized_description(uint32_t kind, NatnetReader reader, NatnetNames& names) {
  std::vector<NatnetName> found;
  bool is_whole = true;
  if (kind == kRigidBody) {
    found.emplace_back().name = reader.take_name();
    found.back().id = reader.take<uint32_t>();
    is_whole = reader.ok();
  } else if (kind == kSkeleton) {
    take_skeleton_names(reader, kNatnetSized, found);
    is_whole = reader.is_done();
  }
  if (is_whole)
    names.names.insert(names.names.end(), found.begin(), found.end());
  else
    ++names.unknown;
}

}  // namespace

std::optional<NatnetFrame> read_natnet_frame(std::span<const std::byte> payload, NatnetVersion version) {
  return FrameReader(payload, version).read();
}

std::optional<NatnetNames> read_natnet_names(std::span<const std::byte> payload, NatnetVersion version) {
  NatnetReader reader(payload);
  NatnetNames names;
  bool is_known = true;
  reader.take_items([&] {
    const auto kind = reader.take<uint32_t>();
    if (version >= kNatnetSized)
      take_sized_description(kind, NatnetReader(reader.take_bytes(reader.take<uint32_t>())), names);
    else if (kind == kRigidBody)
      names.names.push_back(take_body_name(reader, version));
    else if (kind == kSkeleton)
      take_skeleton_names(reader, version, names.names);
    else
      is_known = is_known && skip_description(kind, reader);
  });
  if (!is_known || !reader.is_done()) return std::nullopt;
  return names;
}

std::optional<NatnetServer> read_natnet_server(std::span<const std::byte> payload) {
  constexpr size_t kVersionBytes = 4;
  NatnetReader reader(payload);
  NatnetReader name(reader.take_bytes(kMaxNatnetNameBytes));
  NatnetServer server;
  server.name = name.take_name();
  (void)reader.take_bytes(kVersionBytes);  // of the program
  server.version.major = reader.take<uint8_t>();
  server.version.minor = reader.take<uint8_t>();
  if (!reader.ok() || !name.ok()) return std::nullopt;
  return server;
}

}  // namespace strandcast
