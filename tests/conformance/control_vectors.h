// Kept control messages: the bytes of each beside what they say, as protobuf text. One line a message:
//   client|server BYTES TEXT        the bytes with the opcode in front; the text of ClientMessage or
//   ServerMessage
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "tests/conformance/stored_stream.h"

namespace google::protobuf {
class Message;
}

namespace strandcast::conformance {

struct StoredMessage {
  bool is_client = false;  // sent by one
  Bytes bytes;
  std::string text;
};

/// Every message of the control_*.txt below `folder`.
Result<std::vector<StoredMessage>> load_messages(const std::filesystem::path& folder);

/// "Type.field" of all fields that are set in a message, in parts of it too.
void add_set_fields(const google::protobuf::Message& message, std::set<std::string>& names);
/// Those that can be set in control messages, the kinds of messages included.
std::set<std::string> known_fields();
/// Of stored messages. A message that cannot be parsed has none.
std::set<std::string> set_fields(const std::vector<StoredMessage>& messages);

/// Messages that hold fields which none of `known` has: each of the samples with a new one.
std::vector<StoredMessage> new_messages(const std::vector<StoredMessage>& known);

}  // namespace strandcast::conformance
