// What recordings are made of: messages, batches of them, the schemas beside them; and paths of sessions.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <cctype>

#include "common/record/recording_layout.h"
#include "common/wire/recording_messages.h"
#include "common/wire/session_path.h"
#include "tests/support/sample_recording.h"

namespace strandcast::recorded_messages_test {
namespace {

using test::sample_recorded_messages;
using test::sample_start;
using testing::HasSubstr;

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

TEST(RecordedMessages, ComeBackAsTheyWere) {
  std::vector<RecordedMessage> messages = sample_recorded_messages();
  messages.push_back(sample_start());
  std::set<size_t> kinds;
  for (const RecordedMessage& message : messages) {
    const auto decoded = decode_recorded(message.index(), encode(message));
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    EXPECT_TRUE(*decoded == message) << recorded_kinds()[message.index()].topic;
    kinds.insert(message.index());
  }
  EXPECT_EQ(kinds.size(), recorded_kinds().size()) << "a kind has no sample";
}

TEST(RecordedMessages, AreRefusedWithTheirTopicWhereAFieldIsWrong) {
  RecordedStep step;
  step.joints = {{"neck", "chest"}, {{0.0, 0.0, 0.0}}};  // two names, one place
  const RecordedMessage message = step;
  const auto decoded = decode_recorded(message.index(), encode(message));
  ASSERT_FALSE(decoded);
  EXPECT_THAT(decoded.error().to_string(), HasSubstr("/steps, joint_m: does not go with the names"));
  const auto garbage = decode_recorded(message.index(), bytes_of("\xff\xff\xff"));
  ASSERT_FALSE(garbage);
  EXPECT_THAT(garbage.error().to_string(), HasSubstr("/steps is not valid protobuf"));
}

TEST(MediaMessages, AreProtobufOfOneFieldAtEveryLength) {
  for (const size_t size : {0, 1, 127, 128, 16'383, 16'384, 2'097'152}) {
    const std::vector<std::byte> message(size, std::byte{7});
    const auto encoded = encode_media(message);
    const auto decoded = decode_media(encoded);
    ASSERT_TRUE(decoded) << size;
    EXPECT_TRUE(std::equal(decoded->begin(), decoded->end(), message.begin(), message.end()));
    EXPECT_FALSE(decode_media(std::span(encoded).first(encoded.size() - 1)));
  }
  EXPECT_FALSE(decode_media({}));
}

TEST(RecordBatch, GivesBackItemsWithTheirOrderAndTheTimesOfTheFirstAndTheLast) {
  RecordBatch batch;
  const std::vector<std::string> texts = {"", "a", std::string(300, 'b'), "c"};
  const std::vector<uint32_t> orders = {0xfffffffeu, 0xffffffffu, 4u, 1'000'000u};  // past the end of numbers
  for (size_t i = 0; i < texts.size(); ++i) batch.add(bytes_of(texts[i]), orders[i], 1000 + 30 * i * i);
  const auto bytes = batch.encode();
  const auto items = read_batch(bytes, {batch.first_order(), batch.first_time_ns()});
  ASSERT_TRUE(items) << items.error().to_string();
  ASSERT_EQ(items->size(), texts.size());
  for (size_t i = 0; i < texts.size(); ++i) {
    const auto expected = bytes_of(texts[i]);
    EXPECT_TRUE(
        std::equal((*items)[i].bytes.begin(), (*items)[i].bytes.end(), expected.begin(), expected.end()));
    EXPECT_EQ((*items)[i].order, orders[i]);
    EXPECT_EQ((*items)[i].time_ns, 1000 + 90 * i) << "evenly up to the last one's";
  }
  // Every cut, and every byte behind it, is refused.
  for (size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(read_batch(std::span(bytes).first(size), {})) << size;
  auto longer = bytes;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(read_batch(longer, {}));
  RecordBatch crowd;
  for (size_t i = 0; i <= kMaxBatchItems; ++i) crowd.add({}, static_cast<uint32_t>(i), 0);
  const auto refused = read_batch(crowd.encode(), {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
}

TEST(RecordBatch, TakesNoMoreBytesForAnOrderFarFromZero) {
  const auto bytes_from = [](uint32_t order) {
    RecordBatch batch;
    batch.add(bytes_of("a"), order, 0);
    return batch.encode().size();
  };
  EXPECT_EQ(bytes_from(0xfffffff0u), bytes_from(0));
}

TEST(RecordBatch, RefusesANumberThatIsLongerThanNumbersAre) {
  RecordBatch batch;
  batch.add({}, 0, 0);
  std::vector<std::byte> bytes = batch.encode();
  ASSERT_EQ(bytes[1], std::byte{0});  // how many bytes the item has
  const auto with_zeros = [&](size_t count) {
    std::vector<std::byte> longer(count, std::byte{0x80});
    longer.insert(longer.begin(), bytes[0]);
    longer.insert(longer.end(), bytes.begin() + 1, bytes.end());
    return longer;
  };
  EXPECT_TRUE(read_batch(with_zeros(8), {}));  // nine bytes, 63 bits
  EXPECT_FALSE(read_batch(with_zeros(9), {}));
}

TEST(SessionPath, NamesAreOfLettersDigitsAndThreeSigns) {
  for (int c = 1; c < 128; ++c) {
    const bool is_plain = std::isalnum(c) != 0;
    const std::string first(1, static_cast<char>(c));
    EXPECT_EQ(is_session_name(first), is_plain) << c;
    EXPECT_EQ(is_session_name("a" + first), is_plain || c == '.' || c == '_' || c == '-') << c;
  }
  EXPECT_FALSE(is_session_name(""));
  EXPECT_TRUE(is_session_name(std::string(kMaxSessionNameChars, 'a')));
  EXPECT_FALSE(is_session_name(std::string(kMaxSessionNameChars + 1, 'a')));
  EXPECT_EQ(without_session("/s/anna/v1"), "/v1");
  EXPECT_EQ(without_session("/s/anna"), "");
  EXPECT_EQ(without_session("/s//v1"), "/s//v1");
  EXPECT_EQ(without_session("/v1"), "/v1");
}

TEST(RecordedMessages, HaveALimitOfBytes) {
  const std::vector<std::byte> most(kMaxRecordedMessageBytes, std::byte{0xff});
  const std::vector<std::byte> more(kMaxRecordedMessageBytes + 1, std::byte{0xff});
  EXPECT_EQ(decode_recorded(0, most).error().code, ErrorCode::BadInput) << "no protobuf";
  EXPECT_EQ(decode_recorded(0, more).error().code, ErrorCode::LimitExceeded);
}

/// What stands in a type, without its options; types within it too.
std::string plain_text(google::protobuf::DescriptorProto type) {
  type.clear_options();
  for (auto& field : *type.mutable_field()) field.clear_options();
  for (auto& choice : *type.mutable_enum_type()) choice.clear_options();
  for (int i = 0; i < type.nested_type_size(); ++i)
    if (!type.nested_type(i).options().map_entry()) type.mutable_nested_type(i)->clear_options();
  return type.DebugString();
}

TEST(RecordingSchemas, AreWholeForWhoeverReadsThemAlone) {
  for (const mcap::Schema& schema : recording_schemas()) {
    google::protobuf::FileDescriptorSet set;
    ASSERT_TRUE(set.ParseFromArray(schema.data.data(), static_cast<int>(schema.data.size())));
    // Each file stands after those that it needs, and is taken by who never saw ours.
    google::protobuf::DescriptorPool alone;
    for (const auto& file : set.file()) {
      EXPECT_FALSE(file.has_options());
      for (const auto& type : file.message_type()) {
        EXPECT_FALSE(type.has_options());
        for (const auto& field : type.field()) EXPECT_FALSE(field.has_options()) << field.name();
      }
      for (const auto& choice : file.enum_type()) EXPECT_FALSE(choice.has_options());
      ASSERT_NE(alone.BuildFile(file), nullptr) << schema.name << ": " << file.name();
    }
    const auto* type = alone.FindMessageTypeByName(schema.name);
    ASSERT_NE(type, nullptr) << schema.name;
    const auto* ours = google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(schema.name);
    ASSERT_NE(ours, nullptr) << schema.name;
    google::protobuf::DescriptorProto told, expected;
    type->CopyTo(&told);
    ours->CopyTo(&expected);
    EXPECT_EQ(plain_text(told), plain_text(expected));
  }
}

TEST(RecordingSchemas, HoldWhatTheirMessageNeedsAndNoMore) {
  size_t all_bytes = 0;
  for (const mcap::Schema& schema : recording_schemas()) {
    EXPECT_LT(schema.data.size(), 8192u) << schema.name;
    all_bytes += schema.data.size();
    const std::string text(reinterpret_cast<const char*>(schema.data.data()), schema.data.size());
    EXPECT_THAT(text, HasSubstr(schema.name.substr(schema.name.rfind('.') + 1)));
    if (schema.name == "strandcast.v1.RecordedStates") {
      EXPECT_THAT(text, testing::Not(HasSubstr("SceneDesc")));
      EXPECT_THAT(text, testing::Not(HasSubstr("RecordedStart")));
    }
  }
  EXPECT_LT(all_bytes, 32'768u);
}

}  // namespace
}  // namespace strandcast::recorded_messages_test
