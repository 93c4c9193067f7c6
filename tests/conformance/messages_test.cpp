// Control messages that ever left this repository mean what they meant, by protobuf's own reading of the text
// beside them and by ours of the bytes.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>

#include "common/base/file.h"
#include "common/wire/messages.h"
#include "strandcast/v1/session.pb.h"
#include "tests/conformance/control_vectors.h"

namespace strandcast::conformance::messages_test {
namespace {

namespace pb = google::protobuf;

std::vector<StoredMessage> stored_messages() {
  auto messages = load_messages(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "tests/conformance/vectors");
  EXPECT_TRUE(messages) << messages.error().to_string();
  return messages ? *messages : std::vector<StoredMessage>();
}

/// Clears what `then` has not: fields that came later.
void clear_newer(const pb::Message& then, pb::Message& now) {
  const auto* reflection = now.GetReflection();
  std::vector<const pb::FieldDescriptor*> fields;
  reflection->ListFields(now, &fields);
  for (const auto* field : fields) {
    if (field->is_repeated()) {
      const int size = std::min(reflection->FieldSize(now, field), reflection->FieldSize(then, field));
      for (int i = 0; field->message_type() != nullptr && i < size; ++i)
        clear_newer(reflection->GetRepeatedMessage(then, field, i),
                    *reflection->MutableRepeatedMessage(&now, field, i));
    } else if (!reflection->HasField(then, field)) {
      reflection->ClearField(&now, field);
    } else if (field->message_type() != nullptr) {
      clear_newer(reflection->GetMessage(then, field), *reflection->MutableMessage(&now, field));
    }
  }
}

std::string serialised(const pb::Message& message) {
  return message.SerializeAsString();
}

template <class Message>
void expect_kept(const StoredMessage& stored, const Bytes& encoded_now) {
  const std::string body(reinterpret_cast<const char*>(stored.bytes.data()) + 1, stored.bytes.size() - 1);
  Message from_text;
  ASSERT_TRUE(pb::TextFormat::ParseFromString(stored.text, &from_text));
  EXPECT_EQ(serialised(from_text), body) << "The text means other bytes than it did: numbers and types of "
                                            "fields never change within strandcast.v1.";
  Message now;
  ASSERT_TRUE(now.ParseFromArray(encoded_now.data() + 1, static_cast<int>(encoded_now.size() - 1)));
  clear_newer(from_text, now);
  EXPECT_EQ(serialised(now), body)
      << "A message that is decoded and encoded again loses or changes what it said.";
}

TEST(Conformance, KeptMessagesMeanWhatTheyMeant) {
  for (const StoredMessage& stored : stored_messages()) {
    SCOPED_TRACE(stored.text);
    if (stored.is_client) {
      const auto decoded = decode_client_message(stored.bytes);
      ASSERT_TRUE(decoded) << decoded.error().to_string();
      expect_kept<v1::ClientMessage>(stored, encode(*decoded));
    } else {
      const auto decoded = decode_server_message(stored.bytes);
      ASSERT_TRUE(decoded) << decoded.error().to_string();
      expect_kept<v1::ServerMessage>(stored, encode(*decoded));
    }
  }
}

TEST(Conformance, EveryFieldOfEveryMessageIsKept) {
  const std::set<std::string> held = set_fields(stored_messages());
  for (const std::string& field : known_fields())
    EXPECT_TRUE(held.contains(field))
        << field
        << " is set in no kept message: set it in tests/support/sample_messages.h "
           "and run conformance_write tests/conformance/vectors.";
  for (const std::string& field : held)
    EXPECT_TRUE(known_fields().contains(field)) << field << " was sent once and is gone from proto/.";
}

// What their fields mean stands in the .proto files; proto/schema.py refuses a field without a word.
TEST(WireDocument, ListsEveryMessageWithItsNumber) {
  const auto text = load_text(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "proto/WIRE.md", 1 << 20);
  ASSERT_TRUE(text) << text.error().to_string();
  for (const auto* envelope : {v1::ClientMessage::descriptor(), v1::ServerMessage::descriptor()}) {
    for (int i = 0; i < envelope->field_count(); ++i) {
      const auto& kind = *envelope->field(i);
      const std::string entry = fmt::format(" {} {}", kind.number(), kind.message_type()->name());
      EXPECT_TRUE(text->find(entry + ",") != std::string::npos ||
                  text->find(entry + " |") != std::string::npos)
          << "section 3 of WIRE.md has not:" << entry;
    }
  }
}

}  // namespace
}  // namespace strandcast::conformance::messages_test
