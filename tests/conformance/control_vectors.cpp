#include "tests/conformance/control_vectors.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <sstream>

#include "common/base/check.h"
#include "common/base/file.h"
#include "strandcast/v1/session.pb.h"
#include "tests/support/sample_messages.h"

namespace strandcast::conformance {
namespace {

namespace pb = google::protobuf;

void add_known_fields(const pb::Descriptor& type, std::set<std::string>& names) {
  for (int i = 0; i < type.field_count(); ++i) {
    const pb::FieldDescriptor& field = *type.field(i);
    const bool is_new = names.insert(type.name() + "." + field.name()).second;
    if (is_new && field.message_type() != nullptr) add_known_fields(*field.message_type(), names);
  }
}

template <class Message>
StoredMessage stored_from(const Bytes& bytes) {
  Message parsed;
  CHECK(parsed.ParseFromArray(bytes.data() + 1, static_cast<int>(bytes.size() - 1)));
  StoredMessage stored;
  stored.is_client = std::is_same_v<Message, v1::ClientMessage>;
  stored.bytes = bytes;
  pb::TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  printer.SetUseUtf8StringEscaping(true);
  CHECK(printer.PrintToString(parsed, &stored.text));
  return stored;
}

}  // namespace

Result<std::vector<StoredMessage>> load_messages(const std::filesystem::path& folder) {
  std::vector<StoredMessage> messages;
  std::error_code failure;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failure)) {
    if (!entry.path().filename().string().starts_with("control_")) continue;
    ASSIGN_OR_RETURN(const std::string text, load_text(entry.path(), 1u << 20));
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      const size_t first = std::min(line.find(' '), line.size());
      const size_t second = std::min(line.find(' ', first + 1), line.size());
      auto bytes = from_hex(line.substr(std::min(first + 1, line.size()), second - first - 1));
      if (!bytes || bytes->empty() || second == line.size())
        return at(entry.path().string(), make_error(ErrorCode::BadInput, "a line is no message"));
      messages.push_back({line.substr(0, first) == "client", *bytes, line.substr(second + 1)});
    }
  }
  return messages;
}

void add_set_fields(const pb::Message& message, std::set<std::string>& names) {
  const auto* reflection = message.GetReflection();
  std::vector<const pb::FieldDescriptor*> fields;
  reflection->ListFields(message, &fields);
  for (const auto* field : fields) {
    names.insert(message.GetDescriptor()->name() + "." + field->name());
    if (field->message_type() == nullptr) continue;
    if (!field->is_repeated()) add_set_fields(reflection->GetMessage(message, field), names);
    for (int i = 0; field->is_repeated() && i < reflection->FieldSize(message, field); ++i)
      add_set_fields(reflection->GetRepeatedMessage(message, field, i), names);
  }
}

std::set<std::string> known_fields() {
  std::set<std::string> names;
  add_known_fields(*v1::ClientMessage::descriptor(), names);
  add_known_fields(*v1::ServerMessage::descriptor(), names);
  return names;
}

std::set<std::string> set_fields(const std::vector<StoredMessage>& messages) {
  std::set<std::string> names;
  for (const StoredMessage& stored : messages) {
    v1::ClientMessage client;
    v1::ServerMessage server;
    pb::Message& message = stored.is_client ? static_cast<pb::Message&>(client) : server;
    if (message.ParseFromArray(stored.bytes.data() + 1, static_cast<int>(stored.bytes.size() - 1)))
      add_set_fields(message, names);
  }
  return names;
}

std::vector<StoredMessage> new_messages(const std::vector<StoredMessage>& known) {
  std::vector<StoredMessage> samples;
  for (const auto& message : sample_client_messages())
    samples.push_back(stored_from<v1::ClientMessage>(encode(message)));
  for (const auto& message : sample_server_messages())
    samples.push_back(stored_from<v1::ServerMessage>(encode(message)));
  // Its defaults are not all those of protobuf.
  samples.push_back(stored_from<v1::ServerMessage>(encode(ServerMessage(ServerStatus{}))));
  std::set<std::string> names = set_fields(known);
  std::vector<StoredMessage> fresh;
  for (const StoredMessage& sample : samples) {
    const std::set<std::string> held = set_fields({sample});
    if (!std::ranges::includes(names, held)) fresh.push_back(sample);
    names.insert(held.begin(), held.end());
  }
  return fresh;
}

}  // namespace strandcast::conformance
