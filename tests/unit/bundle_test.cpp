// A recording as one HTML file: the page's parts are in it, and all that a server would have sent.
#include "client/app/bundle_command.h"

#include <gmock/gmock.h>

#include <cstring>

#include "client/app/ctl_commands.h"
#include "common/wire/messages.h"
#include "tests/support/sample_recording.h"

namespace strandcast::bundle_test {
namespace {

using testing::HasSubstr;
using testing::Not;

const PageFile kFiles[] = {
    {.path = "/",
     .plain =
         "<meta name=\"strandcast-assets\" content=\"x\">\n<link rel=\"stylesheet\" href=\"style.0.css\">\n"
         "<script type=\"module\" src=\"main.0.js\"></script>\n<link rel=\"preload\" href=\"a\">\n<main>\n"},
    {.path = "/style.0.css", .plain = "main { color: red }", .gzip = "-"},
    {.path = "/main.0.js", .plain = "-", .gzip = "Man"},
    {.path = "/strand_page.0.wasm", .plain = "-", .gzip = "Ma"},
    {.path = "/strand_step.0.wasm", .plain = "-", .gzip = "M"},
    {.path = "/strand_core.0.wasm", .plain = "-", .gzip = "whole"},
};

std::unique_ptr<RecordingReader> reader_of(mcap::Bytes bytes) {
  return RecordingReader::open(memory_byte_source(std::move(bytes))).value();
}

std::string decoded(std::string_view base64) {
  std::string bytes;
  uint32_t group = 0;
  int bits = 0;
  for (const char c : base64) {
    if (c == '=') break;
    const int digit = c >= 'a'   ? c - 'a' + 26
                      : c >= 'A' ? c - 'A'
                      : c == '+' ? 62
                      : c == '/' ? 63
                                 : c - '0' + 52;
    group = group << 6 | static_cast<uint32_t>(digit);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(group >> bits & 0xff);
  }
  return bytes;
}

/// The text of a script element of the page.
std::string text_of(const std::string& html, const std::string& id) {
  const size_t at = html.find("id=\"" + id + "\"");
  if (at == std::string::npos) return {};
  const size_t begin = html.find('>', at) + 1;
  return html.substr(begin, html.find('<', begin) - begin);
}
/// The bytes of a module or script, 4 in 5 digits of base 85.
std::string file_of(const std::string& html, const std::string& id) {
  const std::string text = text_of(html, id);
  std::string bytes;
  for (size_t at = 0; at < text.size(); at += 5) {
    uint64_t group = 0;
    for (size_t i = at; i < at + 5; ++i) {
      const char digit = i < text.size() ? text[i] : '}';
      group = 85 * group + static_cast<uint64_t>(digit - '#');
      for (const char left_out : std::string_view("&'<>\\`"))
        if (digit > left_out) --group;
    }
    for (size_t i = 0; i + 1 < std::min<size_t>(text.size() - at, 5); ++i)
      bytes += static_cast<char>(group >> (24 - 8 * i) & 0xff);
  }
  return bytes;
}

struct TapeMessage {
  uint32_t time_ms;
  std::string bytes;
};
std::vector<TapeMessage> tape_of(const std::string& html) {
  const std::string tape = decoded(text_of(html, "tape"));
  std::vector<TapeMessage> messages;
  for (size_t at = 4; at + 8 <= tape.size();) {
    uint32_t numbers[2];
    std::memcpy(numbers, tape.data() + at, sizeof numbers);
    messages.push_back({numbers[0], tape.substr(at + 8, numbers[1])});
    at += 8 + numbers[1];
  }
  return messages;
}

TEST(Bundle, HoldsThePageAndAllThatAServerWouldHaveSent) {
  const auto reader = reader_of(test::moving_recording(25));
  const auto bundle = make_bundle(*reader, kFiles, {});
  ASSERT_TRUE(bundle) << bundle.error().to_string();
  EXPECT_EQ(bundle->frame_count, 25u);
  EXPECT_NEAR(bundle->seconds, 2.4, 1e-9);
  EXPECT_THAT(bundle->html, HasSubstr("<style>main { color: red }</style>"));
  EXPECT_THAT(bundle->html, Not(HasSubstr("rel=\"preload\"")));
  EXPECT_THAT(bundle->html, Not(HasSubstr("type=\"module\"")));
  // In base 85 0x4d616e00 is 24 73 80 78 29, and n bytes take n + 1 digits from '#' on.
  EXPECT_EQ(text_of(bundle->html, "script"), "?ryw");
  EXPECT_EQ(text_of(bundle->html, "core"), "?rv");
  EXPECT_EQ(text_of(bundle->html, "stepCore"), "?h");
  EXPECT_EQ(file_of(bundle->html, "script"), "Man");
  EXPECT_EQ(file_of(bundle->html, "core"), "Ma");
  EXPECT_EQ(file_of(bundle->html, "stepCore"), "M");
  EXPECT_GT(bundle->html.find("id=\"end\""), bundle->html.find("id=\"tape\""))
      << "a file that is cut off has none";

  const std::vector<TapeMessage> tape = tape_of(bundle->html);
  ASSERT_EQ(tape.size(), 3u + 25u);
  const auto welcome = decode_server_message(std::as_bytes(std::span(tape[0].bytes)));
  ASSERT_TRUE(welcome) << welcome.error().to_string();
  EXPECT_EQ(std::get<Welcome>(*welcome).codec, "delta");
  EXPECT_EQ(std::get<Welcome>(*welcome).strand_count, 4u);
  EXPECT_EQ(std::get<Welcome>(*welcome).sim_device, test::sample_start().sim_device_name);
  EXPECT_EQ(static_cast<Opcode>(tape[1].bytes[0]), Opcode::Asset);
  const auto look = decode_server_message(std::as_bytes(std::span(tape[2].bytes)));
  ASSERT_TRUE(look) << look.error().to_string();
  EXPECT_EQ(std::get<LookChange>(*look).look, std::get<Welcome>(*welcome).look);
  // What a decoder makes of it is what was recorded.
  auto decoder = make_strand_decoder("delta", {4, 3}).value();
  for (size_t i = 0; i < 25; ++i) {
    EXPECT_EQ(tape[3 + i].time_ms, 100 * i);
    const auto state = decoder->decode(std::as_bytes(std::span(tape[3 + i].bytes)));
    ASSERT_TRUE(state) << state.error().to_string();
    EXPECT_EQ((*state)->tick, i);
  }
}

/// Frames of "raw" that nobody decodes, with looks before some, and another codec behind the third.
mcap::Bytes restyled_recording(const std::string& solver = "dftl") {
  test::MemorySink sink;
  RecordingStart start = test::sample_start();
  start.scene_text = "solver { name: \"" + solver + "\" }";
  RecordingWriter writer(sink, start, *test::sample_asset_frame());
  const int64_t begin_ns = test::sample_start().server_time_ns;
  LookChange red{{}, sample_camera()};
  red.look.hair_color = "red";
  LookChange black = red;
  black.look.hair_color = "black";
  const LookChange looks[] = {red, red, black, black};
  for (uint32_t i = 0; i < 4; ++i) {
    const int64_t sim_time_ns = i * 100'000'000;
    if (i == 3) writer.add(begin_ns + sim_time_ns, sim_time_ns, RecordedStream{i, "raw", 1e-4});
    writer.add(begin_ns + sim_time_ns, sim_time_ns, looks[i]);
    writer.add(begin_ns + sim_time_ns, test::sample_frame(i + 1, i == 0, sim_time_ns));
  }
  writer.finish();
  return sink.all;
}

TEST(Bundle, HasEachLookOnceBeforeTheFrameThatItBeginsWith) {
  const auto bundle = make_bundle(*reader_of(restyled_recording()), kFiles, {});
  ASSERT_TRUE(bundle) << bundle.error().to_string();
  const std::vector<TapeMessage> tape = tape_of(bundle->html);
  ASSERT_EQ(tape.size(), 2u + 5u);
  const auto hair_color = [&](size_t i) {
    const auto message = decode_server_message(std::as_bytes(std::span(tape[i].bytes)));
    return message ? std::get<LookChange>(*message).look.hair_color : message.error().to_string();
  };
  EXPECT_EQ(hair_color(2), "red");
  EXPECT_EQ(hair_color(5), "black");
  EXPECT_EQ(tape[5].time_ms, 200u);
}

TEST(Bundle, EndsWhereTheRecordingChangesItsCodec) {
  const auto bundle = make_bundle(*reader_of(restyled_recording()), kFiles, {});
  ASSERT_TRUE(bundle) << bundle.error().to_string();
  EXPECT_EQ(bundle->frame_count, 3u);
  EXPECT_EQ(bundle->other_codec, "raw");
  EXPECT_EQ(make_bundle(*reader_of(test::moving_recording(3)), kFiles, {})->other_codec, "");
}

TEST(Bundle, IsAsLongAsAskedFor) {
  const auto reader = reader_of(test::moving_recording(25));
  BundleCommand command;
  command.seconds = 1.0;
  const auto bundle = make_bundle(*reader, kFiles, command);
  ASSERT_TRUE(bundle) << bundle.error().to_string();
  EXPECT_EQ(bundle->frame_count, 11u);
}

TEST(Bundle, TakesTheLargerModuleForWhatTheSmallerOneDoesNotStep) {
  const auto module_of = [](const char* solver) {
    return file_of(make_bundle(*reader_of(restyled_recording(solver)), kFiles, {})->html, "stepCore");
  };
  EXPECT_EQ(module_of("dftl"), "M");
  EXPECT_EQ(module_of("direct_rod"), "M");
  EXPECT_EQ(module_of("pbd"), "whole");
}

TEST(Bundle, TakesTheLargerModuleIfAskedFor) {
  const auto reader = reader_of(test::moving_recording(2));
  BundleCommand command;
  command.has_all_solvers = true;
  EXPECT_EQ(file_of(make_bundle(*reader, kFiles, command)->html, "stepCore"), "whole");
}

TEST(Bundle, WritesOverNoRecordingWhosePageWasForgotten) {
  BundleCommand command;
  command.paths = {"run.mcap"};
  testing::internal::CaptureStderr();
  EXPECT_EQ(run_bundle(command, false), kBadInputExit);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("OUT.html, and run.mcap is none"));
}

TEST(Bundle, SaysWhatItLacks) {
  const auto without_page = make_bundle(*reader_of(test::moving_recording(2)), {}, {});
  ASSERT_FALSE(without_page);
  EXPECT_THAT(without_page.error().message, HasSubstr("-DSTRANDCAST_WEB=ON"));
  const auto no_frames = make_bundle(*reader_of(test::moving_recording(0)), kFiles, {});
  ASSERT_FALSE(no_frames);
  EXPECT_THAT(no_frames.error().message, HasSubstr("no frame"));
}

}  // namespace
}  // namespace strandcast::bundle_test
