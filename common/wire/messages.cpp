#include "common/wire/messages.h"

#include <utility>

#include "common/base/check.h"
#include "common/strands/frame_header.h"
#include "common/wire/message_visitors_private.h"
#include "common/wire/parse_message_private.h"
#include "strandcast/v1/session.pb.h"

namespace strandcast {
namespace {

/// Opcode byte and serialised message.
std::vector<std::byte> pack_control(const pb::Message& message) {
  std::vector<std::byte> bytes(1 + message.ByteSizeLong());
  bytes[0] = static_cast<std::byte>(Opcode::Control);
  CHECK(message.SerializeToArray(bytes.data() + 1, static_cast<int>(bytes.size() - 1)));
  return bytes;
}

/// Checks length and opcode, then parses; `message` is valid only after success.
Status parse_control(std::span<const std::byte> bytes, pb::Message& message) {
  if (bytes.size() > kMaxControlBytes)
    return make_error(ErrorCode::LimitExceeded, "control message has {} bytes, the limit is {}", bytes.size(),
                      kMaxControlBytes);
  if (bytes.empty()) return make_error(ErrorCode::BadInput, "control message is empty");
  if (bytes[0] != static_cast<std::byte>(Opcode::Control))
    return make_error(ErrorCode::BadInput, "control message begins with opcode 0x{:02x}, expected 0x01",
                      static_cast<int>(bytes[0]));
  if (!parse_message(bytes.subspan(1), message))
    return make_error(ErrorCode::BadInput, "control message of {} bytes is not valid protobuf", bytes.size());
  return {};
}

/// The kind of message that the variant holds, in the field of its name.
template <class Variant>
std::vector<std::byte> encode_as(pb::Message& out, const Variant& message) {
  std::visit(
      [&](auto kind) {  // a copy: the list of fields is shared with the reader, which writes
        MessageWriter writer(out);
        writer.group(kKind<decltype(kind)>, [&] { wire_fields::visit(writer, kind); });
      },
      message);
  return pack_control(out);
}

template <class Variant>
Result<Variant> decode_as(std::span<const std::byte> bytes, pb::Message& message, const char* sender) {
  RETURN_IF_ERROR(parse_control(bytes, message));
  const auto* kinds = message.GetDescriptor()->FindOneofByName("kind");
  const auto* field = message.GetReflection()->GetOneofFieldDescriptor(message, kinds);
  Variant result;
  MessageReader reader(message);
  // A later version may have more kinds; a message without any is of none.
  const bool may_be_newer = !message.GetReflection()->GetUnknownFields(message).empty();
  if (field == nullptr || !read_kind(field->name(), reader, result))
    return make_error(may_be_newer ? ErrorCode::Unsupported : ErrorCode::BadInput,
                      "{} message is of no kind that protocol {} knows", sender, kWebSocketProtocol);
  RETURN_IF_ERROR(reader.status());
  return result;
}

}  // namespace

std::vector<std::byte> encode(const ClientMessage& message) {
  v1::ClientMessage out;
  return encode_as(out, message);
}

std::vector<std::byte> encode(const ServerMessage& message) {
  v1::ServerMessage out;
  return encode_as(out, message);
}

Result<ClientMessage> decode_client_message(std::span<const std::byte> bytes) {
  v1::ClientMessage message;
  return decode_as<ClientMessage>(bytes, message, "client");
}

Result<ServerMessage> decode_server_message(std::span<const std::byte> bytes) {
  v1::ServerMessage message;
  return decode_as<ServerMessage>(bytes, message, "server");
}

}  // namespace strandcast
