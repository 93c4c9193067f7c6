#include "common/groom/abc_archive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/base/check.h"
#include "common/groom/byte_view.h"
#include "common/groom/text_scan.h"

namespace strandcast {
namespace {

constexpr uint64_t kRootChildren = 6;  // versions, top object, archive metadata, times, indexed metadata
constexpr uint64_t kTopAt = 2, kMetadataAt = 3, kTimesAt = 4, kIndexedAt = 5;
constexpr uint64_t kHashBytes = 32;  // behind an object's headers
constexpr uint64_t kKeyBytes = 16;   // before a sample
constexpr uint32_t kInlineMetadata = 255;
constexpr double kAcyclic = std::numeric_limits<double>::max() / 32.0;
constexpr std::array<uint32_t, 14> kPodBytes = {1, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8, 1, 1};

std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

uint32_t bits(uint32_t info, uint32_t first, uint32_t count) {
  return info >> first & ((1u << count) - 1u);
}

template <class T>
double number_in(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return static_cast<double>(value);
}

}  // namespace

/// Numbers and texts of a block of headers, one behind the other.
struct AbcArchive::HeaderScan {
  explicit HeaderScan(std::span<const std::byte> block) : bytes(block) {}

  Result<uint32_t> number(uint32_t width) {
    if (width > bytes.size()) return make_error(ErrorCode::BadInput, "a block of headers ends too early");
    uint32_t value = 0;
    std::memcpy(&value, bytes.data(), width);
    bytes = bytes.subspan(width);
    return value;
  }
  Result<std::string> text(uint32_t length) {
    if (length > bytes.size())
      return make_error(ErrorCode::BadInput, "a text of {} bytes runs over its block of headers", length);
    std::string value = text_of(bytes.first(length));
    bytes = bytes.subspan(length);
    return value;
  }
  Result<std::string> name(uint32_t width) {
    ASSIGN_OR_RETURN(const uint32_t length, number(width));
    if (length == 0) return make_error(ErrorCode::BadInput, "an object or property has no name");
    if (length > kMaxAbcNameBytes)
      return make_error(ErrorCode::LimitExceeded, "a name of {} bytes, at most {} are allowed", length,
                        kMaxAbcNameBytes);
    return text(length);
  }

  std::span<const std::byte> bytes;
};

size_t AbcSample::count() const {
  return bytes.size() / (size_t{kPodBytes[static_cast<size_t>(pod)]} * extent);
}

double AbcSample::number(size_t element, uint32_t axis) const {
  const size_t width = kPodBytes[static_cast<size_t>(pod)];
  const size_t at = (element * extent + axis) * width;
  CHECK(axis < extent && at + width <= bytes.size());
  const std::byte* const value = bytes.data() + at;
  switch (pod) {
    case AbcPod::Bool:
    case AbcPod::U8:
      return number_in<uint8_t>(value);
    case AbcPod::I8:
      return number_in<int8_t>(value);
    case AbcPod::U16:
      return number_in<uint16_t>(value);
    case AbcPod::I16:
      return number_in<int16_t>(value);
    case AbcPod::U32:
      return number_in<uint32_t>(value);
    case AbcPod::I32:
      return number_in<int32_t>(value);
    case AbcPod::U64:
      return number_in<uint64_t>(value);
    case AbcPod::I64:
      return number_in<int64_t>(value);
    case AbcPod::Float:
      return number_in<float>(value);
    case AbcPod::Double:
      return number_in<double>(value);
    case AbcPod::Half:
    case AbcPod::String:
    case AbcPod::WString:
      break;
  }
  return 0.0;
}

std::vector<std::string> AbcSample::texts() const {
  std::vector<std::string> texts;
  const std::string all = text_of(bytes);
  for (size_t begin = 0; begin < all.size();) {
    const size_t end = std::min(all.find('\0', begin), all.size());
    texts.push_back(all.substr(begin, end - begin));
    begin = end + 1;
  }
  return texts;
}

std::string_view abc_metadata_value(std::string_view metadata, std::string_view key) {
  while (!metadata.empty()) {
    const std::string_view item = metadata.substr(0, metadata.find(';'));
    const size_t equals = item.find('=');
    if (equals != std::string_view::npos && item.substr(0, equals) == key) return item.substr(equals + 1);
    metadata.remove_prefix(std::min(item.size() + 1, metadata.size()));
  }
  return {};
}

const AbcProperty* find_abc_property(const std::vector<AbcProperty>& properties, std::string_view name) {
  const auto found = std::find_if(properties.begin(), properties.end(),
                                  [&](const AbcProperty& property) { return property.name == name; });
  return found == properties.end() ? nullptr : &*found;
}

Result<AbcArchive> AbcArchive::read(AbcContainer container) {
  AbcArchive archive(std::move(container));
  const AbcContainer& file = archive.container_;
  ASSIGN_OR_RETURN(const AbcGroup root, file.group(file.root()));
  if (root.count < kRootChildren)
    return make_error(ErrorCode::BadInput, "its root group has {} children, an archive has {}", root.count,
                      kRootChildren);
  const auto text_at = [&](uint64_t index) -> Result<std::vector<std::byte>> {
    ASSIGN_OR_RETURN(const AbcChild child, file.child(root, index));
    ASSIGN_OR_RETURN(const AbcBlock block, file.block(child));
    return file.read(block, kMaxAbcHeaderBytes);
  };
  ASSIGN_OR_RETURN(archive.top_.child, file.child(root, kTopAt));
  ASSIGN_OR_RETURN(const auto metadata, text_at(kMetadataAt));
  archive.metadata_ = text_of(metadata);
  ASSIGN_OR_RETURN(const auto times, text_at(kTimesAt));
  RETURN_IF_ERROR(archive.read_times(times));
  ASSIGN_OR_RETURN(const auto indexed, text_at(kIndexedAt));
  RETURN_IF_ERROR(archive.read_indexed_metadata(indexed));
  return archive;
}

Status AbcArchive::read_times(const std::vector<std::byte>& bytes) {
  constexpr uint64_t kEntryBytes = sizeof(uint32_t) + sizeof(double) + sizeof(uint32_t);
  const ByteView view(bytes);
  for (uint64_t at = 0; at < bytes.size();) {
    if (!view.has(at, 1, kEntryBytes))
      return make_error(ErrorCode::BadInput, "time sampling {} is cut off", times_.size());
    Times times;
    times.cycle_s = view.get<double>(at + sizeof(uint32_t));
    times.is_acyclic = times.cycle_s == kAcyclic;
    const auto count = view.get<uint32_t>(at + sizeof(uint32_t) + sizeof(double));
    at += kEntryBytes;
    if (!(times.cycle_s > 0.0) || !std::isfinite(times.cycle_s))
      return make_error(ErrorCode::BadInput, "time sampling {} has {} s per cycle", times_.size(),
                        times.cycle_s);
    if (count == 0 || !view.has(at, count, sizeof(double)))
      return make_error(ErrorCode::BadInput, "time sampling {} says that it has {} times", times_.size(),
                        count);
    for (uint32_t i = 0; i < count; ++i, at += sizeof(double)) {
      times.time_s.push_back(view.get<double>(at));
      const bool is_later = i == 0 || times.time_s[i] > times.time_s[i - 1];
      if (!std::isfinite(times.time_s[i]) || !is_later)
        return make_error(ErrorCode::BadInput, "time {} of time sampling {} is {} s: times have to increase",
                          i, times_.size(), times.time_s[i]);
    }
    times_.push_back(std::move(times));
  }
  return {};
}

Status AbcArchive::read_indexed_metadata(const std::vector<std::byte>& bytes) {
  HeaderScan scan(bytes);
  while (!scan.bytes.empty()) {
    ASSIGN_OR_RETURN(const uint32_t length, scan.number(1));
    ASSIGN_OR_RETURN(std::string text, scan.text(length));
    indexed_metadata_.push_back(std::move(text));
  }
  return {};
}

Result<std::string> AbcArchive::metadata_at(HeaderScan& scan, uint32_t index, uint32_t width) const {
  if (index == kInlineMetadata) {
    ASSIGN_OR_RETURN(const uint32_t length, scan.number(width));
    return scan.text(length);
  }
  if (index < indexed_metadata_.size()) return indexed_metadata_[index];
  return make_error(ErrorCode::BadInput, "description {} of {} is asked for", index,
                    indexed_metadata_.size() - 1);
}

Result<std::vector<AbcObject>> AbcArchive::objects(const AbcObject& parent) const {
  ASSIGN_OR_RETURN(const AbcGroup group, container_.group(parent.child));
  ASSIGN_OR_RETURN(const auto children, container_.children(group, kMaxAbcObjects + 2));
  if (children.size() < 2)
    return make_error(ErrorCode::BadInput, "an object's group has {} children", children.size());
  ASSIGN_OR_RETURN(const AbcBlock block, container_.block(children.back()));
  ASSIGN_OR_RETURN(const auto bytes, container_.read(block, kMaxAbcHeaderBytes));
  if (bytes.size() < kHashBytes)
    return make_error(ErrorCode::BadInput, "{} bytes of object headers", bytes.size());
  HeaderScan scan{std::span(bytes).first(bytes.size() - kHashBytes)};
  std::vector<AbcObject> objects;
  for (size_t i = 1; i + 1 < children.size(); ++i) {
    AbcObject object;
    ASSIGN_OR_RETURN(object.name, scan.name(sizeof(uint32_t)));
    if (object.name.find('/') != std::string::npos)
      return make_error(ErrorCode::BadInput, "an object is called {}", strandcast::quoted(object.name));
    ASSIGN_OR_RETURN(const uint32_t index, scan.number(1));
    ASSIGN_OR_RETURN(object.metadata, metadata_at(scan, index, sizeof(uint32_t)));
    object.child = children[i];
    objects.push_back(std::move(object));
  }
  return objects;
}

Result<std::vector<AbcProperty>> AbcArchive::properties(const AbcObject& object) const {
  ASSIGN_OR_RETURN(const AbcGroup group, container_.group(object.child));
  ASSIGN_OR_RETURN(const AbcChild compound, container_.child(group, 0));
  return read_properties(compound);
}

Result<std::vector<AbcProperty>> AbcArchive::properties(const AbcProperty& compound) const {
  if (compound.kind != AbcPropertyKind::Compound) return std::vector<AbcProperty>();
  return read_properties(compound.child);
}

Result<std::vector<AbcProperty>> AbcArchive::read_properties(AbcChild compound) const {
  ASSIGN_OR_RETURN(const AbcGroup group, container_.group(compound));
  std::vector<AbcProperty> properties;
  if (group.count == 0) return properties;
  ASSIGN_OR_RETURN(const auto children, container_.children(group, kMaxAbcProperties + 1));
  ASSIGN_OR_RETURN(const AbcBlock block, container_.block(children.back()));
  ASSIGN_OR_RETURN(const auto bytes, container_.read(block, kMaxAbcHeaderBytes));
  HeaderScan scan(bytes);
  for (size_t i = 0; i + 1 < children.size(); ++i) {
    ASSIGN_OR_RETURN(AbcProperty property, read_property(scan));
    property.child = children[i];
    properties.push_back(std::move(property));
  }
  return properties;
}

Result<AbcProperty> AbcArchive::read_property(HeaderScan& scan) const {
  ASSIGN_OR_RETURN(const uint32_t info, scan.number(sizeof(uint32_t)));
  const uint32_t kind = bits(info, 0, 2), hint = bits(info, 2, 2), pod = bits(info, 4, 4);
  if (hint > 2) return make_error(ErrorCode::BadInput, "a property header has the size hint {}", hint);
  const uint32_t width = 1u << hint;
  AbcProperty property;
  property.kind = static_cast<AbcPropertyKind>(std::min(kind, 2u));
  if (property.kind != AbcPropertyKind::Compound) {
    property.extent = bits(info, 12, 8);
    if (pod >= kPodBytes.size() || property.extent == 0)
      return make_error(ErrorCode::BadInput, "a property has element type {} and extent {}", pod,
                        property.extent);
    property.pod = static_cast<AbcPod>(pod);
    ASSIGN_OR_RETURN(property.sample_count, scan.number(width));
    if (bits(info, 9, 1) != 0) {
      ASSIGN_OR_RETURN(property.first_changed, scan.number(width));
      ASSIGN_OR_RETURN(property.last_changed, scan.number(width));
    } else if (bits(info, 11, 1) == 0 && property.sample_count > 1) {
      property.first_changed = 1;
      property.last_changed = property.sample_count - 1;
    }
    if (bits(info, 8, 1) != 0) {
      ASSIGN_OR_RETURN(property.times, scan.number(width));
    }
  }
  ASSIGN_OR_RETURN(property.name, scan.name(width));
  ASSIGN_OR_RETURN(property.metadata, metadata_at(scan, bits(info, 20, 8), width));
  if (property.first_changed > property.last_changed)
    return make_error(ErrorCode::BadInput, "property {} changes first at sample {} and last at {}",
                      strandcast::quoted(property.name), property.first_changed, property.last_changed);
  const bool is_timed = property.kind != AbcPropertyKind::Compound && property.sample_count > 0;
  if (is_timed && property.times >= times_.size())
    return make_error(ErrorCode::BadInput, "property {} has time sampling {} of {}",
                      strandcast::quoted(property.name), property.times, times_.size());
  return property;
}

Result<AbcSample> AbcArchive::sample(const AbcProperty& property, uint64_t index, uint64_t limit) const {
  AbcSample sample;
  sample.pod = property.pod;
  sample.extent = property.extent;
  const auto fail = [&](Error error) {
    return at("property " + strandcast::quoted(property.name), std::move(error));
  };
  if (property.kind == AbcPropertyKind::Compound)
    return fail(make_error(ErrorCode::BadInput, "it has no samples"));
  if (property.sample_count == 0) return sample;
  index = std::min(index, property.sample_count - 1);
  uint64_t slot = index - property.first_changed + 1;
  if (index < property.first_changed || property.last_changed == 0)
    slot = 0;
  else if (index >= property.last_changed)
    slot = property.last_changed - property.first_changed + 1;
  const bool is_array = property.kind == AbcPropertyKind::Array;
  const auto read = [&]() -> Result<std::vector<std::byte>> {
    ASSIGN_OR_RETURN(const AbcGroup group, container_.group(property.child));
    ASSIGN_OR_RETURN(const AbcChild child, container_.child(group, is_array ? 2 * slot : slot));
    ASSIGN_OR_RETURN(const AbcBlock block, container_.block(child));
    if (block.size_bytes == 0) return std::vector<std::byte>();
    if (block.size_bytes < kKeyBytes)
      return make_error(ErrorCode::BadInput, "a sample of {} bytes is shorter than its key",
                        block.size_bytes);
    const uint64_t element_bytes = uint64_t{kPodBytes[static_cast<size_t>(property.pod)]} * property.extent;
    const uint64_t size_bytes = block.size_bytes - kKeyBytes;
    if (size_bytes % element_bytes != 0)
      return make_error(ErrorCode::BadInput, "a sample of {} bytes is no multiple of {}", size_bytes,
                        element_bytes);
    if (size_bytes / element_bytes > limit)
      return make_error(ErrorCode::LimitExceeded, "{} elements, at most {} are allowed",
                        size_bytes / element_bytes, limit);
    return container_.read({block.offset + kKeyBytes, size_bytes}, size_bytes);
  };
  auto bytes = read();
  if (!bytes) return fail(bytes.error());
  sample.bytes = std::move(bytes).value();
  const bool is_text = property.pod == AbcPod::String || property.pod == AbcPod::WString;
  if (!is_array && !is_text && sample.count() != 1)
    return fail(make_error(ErrorCode::BadInput, "{} elements where one belongs", sample.count()));
  return sample;
}

double AbcArchive::time_s(const AbcProperty& property, uint64_t index) const {
  if (property.times >= times_.size()) return 0.0;
  const Times& times = times_[property.times];
  const uint64_t count = times.time_s.size();
  if (times.is_acyclic) return times.time_s[std::min(index, count - 1)];
  return times.time_s[index % count] + times.cycle_s * static_cast<double>(index / count);
}

uint64_t AbcArchive::nearest_sample(const AbcProperty& property, double time_s) const {
  uint64_t low = 0, high = property.sample_count == 0 ? 0 : property.sample_count - 1;
  while (high - low > 1) {
    const uint64_t middle = low + (high - low) / 2;
    (this->time_s(property, middle) <= time_s ? low : high) = middle;
  }
  const double below = time_s - this->time_s(property, low), above = this->time_s(property, high) - time_s;
  return below <= above ? low : high;
}

}  // namespace strandcast
