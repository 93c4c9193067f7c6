#include "common/wire/recording_messages.h"

#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "common/base/check.h"
#include "common/strands/byte_io.h"
#include "common/wire/message_visitors_private.h"
#include "common/wire/parse_message_private.h"
#include "common/wire/recording_fields_private.h"
#include "strandcast/v1/recording.pb.h"

namespace strandcast {

std::string take_text(const std::string& slate, uint32_t take) {
  std::string text = slate.empty() ? std::string() : "slate " + slate;
  if (take > 0) text += fmt::format("{}take {}", text.empty() ? "" : ", ", take);
  return text;
}

namespace {

/// The message of each kind, in the order of RecordedMessage.
using Wires = std::tuple<v1::RecordingStart, v1::RecordedMotion, v1::RecordedWind, v1::RecordedStep,
                         v1::RecordedChange, v1::RecordedStream, v1::RecordedState, v1::RecordedCamera,
                         v1::RecordedLoss, v1::LookChange, v1::ServerStatus, v1::RecordedHandOver>;
constexpr size_t kKindCount = std::variant_size_v<RecordedMessage>;
static_assert(std::tuple_size_v<Wires> == kKindCount);

constexpr std::array<RecordedKind, kKindCount> kKinds{{
    {"/recording", "strandcast.v1.RecordingStart"},
    {"/input/motion", "strandcast.v1.RecordedMotions", true},
    {"/input/wind", "strandcast.v1.RecordedWinds", true},
    {"/steps", "strandcast.v1.RecordedSteps", true},
    {"/changes", "strandcast.v1.RecordedChange"},
    {"/stream", "strandcast.v1.RecordedStream"},
    {"/states", "strandcast.v1.RecordedStates", true},
    {"/cameras", "strandcast.v1.RecordedCamera"},
    {"/losses", "strandcast.v1.RecordedLoss"},
    {"/look", "strandcast.v1.LookChange"},
    {"/status", "strandcast.v1.ServerStatus"},
    {"/hand_overs", "strandcast.v1.RecordedHandOver"},
}};

constexpr std::byte kMediaTag{0x0a};  // field 1, of bytes
constexpr size_t kVarintBits = 7;
constexpr size_t kVarintMore = 1u << kVarintBits;
constexpr size_t kMostVarintBytes = 9;  // 63 bits

template <class Kind, size_t... i>
constexpr size_t find_kind(std::index_sequence<i...>) {
  return ((std::is_same_v<Kind, std::variant_alternative_t<i, RecordedMessage>> ? i : 0) + ...);
}
template <class Kind>
constexpr size_t kIndexOf = find_kind<Kind>(std::make_index_sequence<kKindCount>());

std::vector<std::byte> serialised(const pb::Message& message) {
  std::vector<std::byte> bytes(message.ByteSizeLong());
  CHECK(message.SerializeToArray(bytes.data(), static_cast<int>(bytes.size())));
  return bytes;
}

template <size_t kind>
Result<RecordedMessage> decode_as(std::span<const std::byte> bytes) {
  std::tuple_element_t<kind, Wires> wire;
  if (!parse_message(bytes, wire))
    return make_error(ErrorCode::BadInput, "a message of {} bytes on {} is not valid protobuf", bytes.size(),
                      kKinds[kind].topic);
  RecordedMessage message(std::in_place_index<kind>);
  MessageReader reader(wire);
  wire_fields::visit(reader, std::get<kind>(message));
  if (const Status status = reader.status(); !status) return at(kKinds[kind].topic, status.error());
  return message;
}

template <size_t... kind>
Result<RecordedMessage> decode_one(size_t wanted, std::span<const std::byte> bytes,
                                   std::index_sequence<kind...>) {
  using Decode = Result<RecordedMessage> (*)(std::span<const std::byte>);
  constexpr std::array<Decode, sizeof...(kind)> kDecoders{decode_as<kind>...};
  return kDecoders[wanted](bytes);
}

/// The types at the top of their files that a message is made of.
void add_types(const pb::Descriptor& type, std::set<const pb::Descriptor*>& types,
               std::set<const pb::EnumDescriptor*>& enums) {
  if (type.containing_type() != nullptr) return add_types(*type.containing_type(), types, enums);
  if (!types.insert(&type).second) return;
  std::vector<const pb::Descriptor*> open{&type};
  while (!open.empty()) {
    const pb::Descriptor& one = *open.back();
    open.pop_back();
    for (int i = 0; i < one.nested_type_count(); ++i) open.push_back(one.nested_type(i));
    for (int i = 0; i < one.field_count(); ++i) {
      if (const auto* message = one.field(i)->message_type()) add_types(*message, types, enums);
      const auto* choice = one.field(i)->enum_type();
      if (choice != nullptr && choice->containing_type() == nullptr) enums.insert(choice);
      if (choice != nullptr && choice->containing_type() != nullptr)
        add_types(*choice->containing_type(), types, enums);
    }
  }
}

/// Options are for this source alone: a recording has none of them.
void clear_options(pb::DescriptorProto& type) {
  type.clear_options();
  for (auto& field : *type.mutable_field()) field.clear_options();
  for (auto& inner : *type.mutable_nested_type())
    if (!inner.options().map_entry()) clear_options(inner);
  for (auto& choice : *type.mutable_enum_type()) choice.clear_options();
}

/// Adds a file with these types alone, after the files that it needs.
void add_file(const pb::FileDescriptor& file, const std::set<const pb::Descriptor*>& types,
              const std::set<const pb::EnumDescriptor*>& enums, pb::FileDescriptorSet& set) {
  const auto is_known = [&](const pb::FileDescriptor& other) {
    return std::any_of(set.file().begin(), set.file().end(),
                       [&](const auto& known) { return known.name() == other.name(); });
  };
  if (is_known(file)) return;
  for (int i = 0; i < file.dependency_count(); ++i) add_file(*file.dependency(i), types, enums, set);
  pb::FileDescriptorProto part;
  part.set_name(file.name());
  part.set_package(file.package());
  part.set_syntax("proto3");
  for (int i = 0; i < file.message_type_count(); ++i)
    if (types.count(file.message_type(i)) > 0) {
      file.message_type(i)->CopyTo(part.add_message_type());
      clear_options(*part.mutable_message_type()->rbegin());
    }
  for (int i = 0; i < file.enum_type_count(); ++i)
    if (enums.count(file.enum_type(i)) > 0) {
      file.enum_type(i)->CopyTo(part.add_enum_type());
      part.mutable_enum_type()->rbegin()->clear_options();
    }
  if (part.message_type_size() + part.enum_type_size() == 0) return;
  for (int i = 0; i < file.dependency_count(); ++i)
    if (is_known(*file.dependency(i))) part.add_dependency(file.dependency(i)->name());
  *set.add_file() = std::move(part);
}

}  // namespace

std::span<const RecordedKind> recorded_kinds() {
  return kKinds;
}

std::vector<std::byte> message_descriptors(const std::string& schema) {
  v1::RecordingStart::descriptor();  // the file that knows all others is linked
  const auto* type = pb::DescriptorPool::generated_pool()->FindMessageTypeByName(schema);
  CHECK(type != nullptr);
  std::set<const pb::Descriptor*> types;
  std::set<const pb::EnumDescriptor*> enums;
  add_types(*type, types, enums);
  pb::FileDescriptorSet set;
  add_file(*type->file(), types, enums, set);
  return serialised(set);
}

/// By hand: a large message is copied once.
std::vector<std::byte> encode_media(std::span<const std::byte> message) {
  std::vector<std::byte> bytes{kMediaTag};
  bytes.reserve(message.size() + kMostVarintBytes + 1);
  size_t size = message.size();
  for (; size >= kVarintMore; size >>= kVarintBits)
    bytes.push_back(static_cast<std::byte>(size % kVarintMore + kVarintMore));
  bytes.push_back(static_cast<std::byte>(size));
  bytes.insert(bytes.end(), message.begin(), message.end());
  return bytes;
}

/// Exactly the one field: what a later version adds has another schema.
Result<std::span<const std::byte>> decode_media(std::span<const std::byte> bytes) {
  uint64_t size = 0;
  size_t at = 1;
  for (uint32_t shift = 0; at < bytes.size() && at <= kMostVarintBytes; ++at, shift += kVarintBits) {
    const auto byte = static_cast<uint64_t>(bytes[at]);
    size |= (byte % kVarintMore) << shift;
    if (byte < kVarintMore) break;
  }
  if (bytes.empty() || bytes[0] != kMediaTag || at + 1 > bytes.size() || size != bytes.size() - at - 1)
    return make_error(ErrorCode::BadInput, "a message of {} bytes is no MediaMessage", bytes.size());
  return bytes.subspan(at + 1);
}

std::vector<std::byte> encode(const RecordedMessage& message) {
  return std::visit(
      [&](auto kind) {  // a copy: the list of fields is shared with the reader, which writes
        std::tuple_element_t<kIndexOf<decltype(kind)>, Wires> wire;
        MessageWriter writer(wire);
        wire_fields::visit(writer, kind);
        return serialised(wire);
      },
      message);
}

Result<RecordedMessage> decode_recorded(size_t kind, std::span<const std::byte> bytes) {
  CHECK(kind < kKindCount);
  if (bytes.size() > kMaxRecordedMessageBytes)
    return make_error(ErrorCode::LimitExceeded, "a message on {} has {} bytes, the limit is {}",
                      kKinds[kind].topic, bytes.size(), kMaxRecordedMessageBytes);
  return decode_one(kind, bytes, std::make_index_sequence<kKindCount>());
}

namespace {

constexpr std::byte kItemTag{0x0a};   // field 1, of bytes
constexpr std::byte kOrderTag{0x12};  // field 2, packed
constexpr std::byte kSpanTag{0x19};   // field 3, fixed64
constexpr uint64_t kBatchVarintBits = 7;
constexpr uint64_t kBatchVarintMore = 1u << kBatchVarintBits;
constexpr uint64_t kMostVarintShift = 63;

void put_varint(uint64_t value, std::vector<std::byte>& bytes) {
  for (; value >= kBatchVarintMore; value >>= kBatchVarintBits)
    bytes.push_back(static_cast<std::byte>(value % kBatchVarintMore + kBatchVarintMore));
  bytes.push_back(static_cast<std::byte>(value));
}

/// Reads what put_varint() wrote; nothing where it is too long or cut off.
std::optional<uint64_t> take_varint(ByteReader& reader) {
  uint64_t value = 0;
  for (uint64_t shift = 0; shift < kMostVarintShift; shift += kBatchVarintBits) {
    const uint64_t byte = reader.take<uint8_t>();
    if (!reader.ok()) return std::nullopt;
    value |= (byte % kBatchVarintMore) << shift;
    if (byte < kBatchVarintMore) return value;
  }
  return std::nullopt;
}

/// A field of bytes behind its tag.
std::optional<std::span<const std::byte>> take_field(ByteReader& reader) {
  const auto size = take_varint(reader);
  if (!size || *size > reader.rest().size()) return std::nullopt;
  return reader.take_bytes(static_cast<size_t>(*size));
}

bool has_tag(const ByteReader& reader, std::byte tag) {
  return !reader.rest().empty() && reader.rest().front() == tag;
}

/// Orders and times of the items, from what stands behind them.
bool read_places(ByteReader& reader, const BatchStart& start, std::vector<BatchItem>& items) {
  if (!has_tag(reader, kOrderTag)) return false;
  reader.take<uint8_t>();
  const auto packed = take_field(reader);
  if (!packed || !has_tag(reader, kSpanTag)) return false;
  reader.take<uint8_t>();
  const auto span_ns = reader.take<uint64_t>();
  if (!reader.ok() || !reader.rest().empty()) return false;
  ByteReader steps(*packed);
  uint32_t order = start.order;
  for (size_t i = 0; i < items.size(); ++i) {
    const auto step = take_varint(steps);
    if (!step) return false;
    order += static_cast<uint32_t>(*step);
    items[i].order = order;
    const double share = i > 0 ? static_cast<double>(i) / static_cast<double>(items.size() - 1) : 0.0;
    // A span that no recording has may be any number; it must only be one.
    const double passed_ns = share * static_cast<double>(span_ns % (uint64_t{1} << 62));
    items[i].time_ns = start.time_ns + static_cast<uint64_t>(passed_ns);
  }
  return steps.rest().empty();
}

}  // namespace

void RecordBatch::add(std::span<const std::byte> message, uint32_t order, uint64_t time_ns) {
  if (is_empty()) {
    first_order_ = last_order_ = order;
    first_time_ns_ = time_ns;
  }
  items_.push_back(kItemTag);
  put_varint(message.size(), items_);
  items_.insert(items_.end(), message.begin(), message.end());
  order_steps_.push_back(order - last_order_);
  last_order_ = order;
  last_time_ns_ = time_ns;
}

std::vector<std::byte> RecordBatch::encode() const {
  std::vector<std::byte> steps;
  for (const uint32_t step : order_steps_) put_varint(step, steps);
  std::vector<std::byte> bytes = items_;
  bytes.push_back(kOrderTag);
  put_varint(steps.size(), bytes);
  ByteWriter writer(bytes);
  writer.put_bytes(steps);
  bytes.push_back(kSpanTag);
  writer.put(last_time_ns_ - first_time_ns_);
  return bytes;
}

Result<std::vector<BatchItem>> read_batch(std::span<const std::byte> bytes, const BatchStart& start) {
  std::vector<BatchItem> items;
  ByteReader reader(bytes);
  bool is_whole = true;
  while (is_whole && has_tag(reader, kItemTag)) {
    reader.take<uint8_t>();
    const auto item = take_field(reader);
    is_whole = item.has_value();
    if (!item) break;
    if (items.size() == kMaxBatchItems)
      return make_error(ErrorCode::LimitExceeded, "a message has more than {} items", kMaxBatchItems);
    items.push_back({*item});
  }
  if (!is_whole || items.empty() || !read_places(reader, start, items))
    return make_error(ErrorCode::BadInput, "a message of {} bytes is not a list of items with their order",
                      bytes.size());
  return items;
}

}  // namespace strandcast
