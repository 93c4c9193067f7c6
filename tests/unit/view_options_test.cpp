// Every option of strandcast-view: the field that it sets, and that it sets no other.
#include "client/app/view_options.h"

#include <fstream>

#include "tests/support/option_table.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::test {

inline void tell(FieldTexts& told, const std::string& where, const Address& all) {
  OPTION_FIELDS(all, host, port, is_tls, session);
}
inline void tell(FieldTexts& told, const std::string& where, const RenderSize& all) {
  OPTION_FIELDS(all, width, height);
}
inline void tell(FieldTexts& told, const std::string& where, const RenderDeviceConfig& all) {
  OPTION_FIELDS(all, renderer, gl_device, shader_folder, driver_threads);
}
inline void tell(FieldTexts& told, const std::string& where, const ViewOptions& all) {
  OPTION_FIELDS(all, address, recording, film, film_fps, film_from_s, film_to_s, mode, playout,
                tls_authorities, picture_codecs, codec_wish, head, token, size, is_diagnosis, is_headless,
                keeps_camera, is_view_only, screenshot, after_frames, clip, clip_s, clip_fps, clip_size,
                seconds, report, trace, drawing, log_level);
}

}  // namespace strandcast::test

namespace strandcast::view_options_test {
namespace {

using test::OptionRow;
using test::text_of;

ViewCommandLine parse(const test::Arguments& given) {
  std::vector<const char*> arguments{"strandcast-view"};
  for (const std::string& word : given) arguments.push_back(word.c_str());
  return read_view_command_line(static_cast<int>(arguments.size()), arguments.data());
}

std::optional<test::FieldTexts> fields_of(const test::Arguments& given) {
  const ViewCommandLine line = parse(given);
  if (!line.options) return std::nullopt;
  test::FieldTexts told;
  tell(told, {}, *line.options);
  return told;
}

const test::Arguments kFilm = {"run.mcap", "--export", "out.webm"};
const test::Arguments kHeadless = {"--headless"};

const OptionRow kRows[] = {
    {"recording", {"run.mcap"}, {{"recording", "run.mcap"}}},
    {"--export", {"out.webm"}, {{"film", "out.webm"}}, {"run.mcap"}},
    {"--fps", {"12"}, {{"film_fps", "12"}}, kFilm},
    {"--from", {"1.5"}, {{"film_from_s", "1.5"}}, kFilm},
    {"--to", {"3"}, {{"film_to_s", "3"}}, kFilm},
    {"--connect", {"other:81"}, {{"address.host", "other"}, {"address.port", "81"}}},
    {"--diagnose",
     {"other:81"},
     {{"address.host", "other"}, {"address.port", "81"}, {"is_diagnosis", "true"}}},
    {"--mode", {"frames"}, {{"mode", text_of(StreamMode::Frames)}}},
    {"--mode", {"strands"}, {{"mode", text_of(StreamMode::Strands)}}},
    {"--pictures", {"jpeg"}, {{"picture_codecs", text_of(codec_bit(PictureCodec::Jpeg))}}},
    {"--pictures", {"tiles"}, {{"picture_codecs", text_of(codec_bit(PictureCodec::JpegTiles))}}},
    {"--pictures", {"vp8"}, {{"picture_codecs", text_of(codec_bit(PictureCodec::Vp8))}}},
    {"--codec", {"tangent"}, {{"codec_wish", "tangent"}}},
    {"--head", {"anna"}, {{"head", "anna"}}},
    {"--token", {"secret"}, {{"token", "secret"}}},
    {"--tls", {}, {{"address.is_tls", "true"}}},
    {"--tls-ca", {"ca.pem"}, {{"address.is_tls", "true"}, {"tls_authorities", "ca.pem"}}},
    {"--view-only", {}, {{"is_view_only", "true"}}},
    {"--size",
     {"64x36"},
     {{"size.width", "64"}, {"size.height", "36"}, {"clip_size.width", "64"}, {"clip_size.height", "36"}}},
    {"--playout", {"smooth"}, {{"playout", text_of(Playout::Smooth)}}},
    {"--headless", {}, {{"is_headless", "true"}}},
    {"--screenshot", {"a.png"}, {{"screenshot", "a.png"}}, kHeadless},
    {"--after-frames", {"7"}, {{"after_frames", "7"}}},
    {"--clip", {"a.webp"}, {{"clip", "a.webp"}}, kHeadless},
    {"--clip-seconds", {"2"}, {{"clip_s", "2"}}},
    {"--clip-fps", {"10"}, {{"clip_fps", "10"}}},
    {"--clip-size", {"64x36"}, {{"clip_size.width", "64"}, {"clip_size.height", "36"}}},
    {"--seconds", {"5"}, {{"seconds", "5"}}},
    {"--report", {"r.txt"}, {{"report", "r.txt"}}},
    {"--trace", {"t.csv"}, {{"trace", "t.csv"}}},
    {"--own-camera", {}, {{"keeps_camera", "true"}}},
    {"--renderer", {"tiles"}, {{"drawing.renderer", "tiles"}}},
    {"--shader-dir", {"s"}, {{"drawing.shader_folder", "s"}}},
    {"--device", {"software"}, {{"drawing.gl_device", "software"}}},
    {"--log", {"debug"}, {{"log_level", "debug"}}}};

TEST(ViewOptionTable, EveryOptionChangesItsFieldAndNoOther) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "token").string();
  std::ofstream(path) << "plain\n";
  std::vector<OptionRow> rows(std::begin(kRows), std::end(kRows));
  rows.push_back({"--token-file", {path}, {{"token", "plain"}}});
  test::expect_changes(rows, fields_of);
  testing::internal::CaptureStdout();
  EXPECT_EQ(parse({"--help"}).exit_code, 0);
  test::expect_all_options(rows, testing::internal::GetCapturedStdout());
}

TEST(ViewOptionTable, NumbersEndWhereTheyAreSaidTo) {
  const test::OptionRange kRanges[] = {{"--fps", "0.9", "1", "60", "61", kFilm},
                                       {"--from", "-1", "0", "86400", "86401", kFilm},
                                       {"--to", "-1", "0", "86400", "86401", kFilm},
                                       {"--after-frames", "0", "1", "1000000", "1000001"},
                                       {"--clip-seconds", "0.09", "0.1", "60", "61"},
                                       {"--clip-fps", "0.9", "1", "60", "61"},
                                       {"--seconds", "0.09", "0.1", "1000000", "1000001"},
                                       {"--size", "15x16", "16x16", "8192x8192", "8193x8192"}};
  testing::internal::CaptureStderr();
  test::expect_ranges(kRanges,
                      [](const test::Arguments& arguments) { return parse(arguments).options.has_value(); });
  (void)testing::internal::GetCapturedStderr();
}

// What a server is told of it: every field of its own, under values that differ from all first ones.
TEST(ViewOptionTable, AHelloSaysWhatWasAskedFor) {
  const auto line = parse({"--connect", "wss://other:81", "--mode", "frames", "--token", "secret", "--size",
                           "64x36", "--pictures", "vp8", "--codec", "tangent", "--own-camera", "--head",
                           "anna", "--view-only", "--tls-ca", "ca.pem"});
  ASSERT_TRUE(line.options);
  const ClientConfig config = client_config(*line.options);
  EXPECT_EQ(config.address, (Address{"other", 81, true}));
  EXPECT_EQ(config.tls_authorities, "ca.pem");
  EXPECT_EQ(config.hello.role, Role::Viewer);
  EXPECT_EQ(config.hello.mode, StreamMode::Frames);
  EXPECT_EQ(config.hello.token, "secret");
  EXPECT_EQ(config.hello.frame_width, 64u);
  EXPECT_EQ(config.hello.frame_height, 36u);
  EXPECT_EQ(config.hello.picture_codecs, codec_bit(PictureCodec::Vp8));
  EXPECT_EQ(config.hello.codec_wish, "tangent");
  EXPECT_TRUE(config.hello.keeps_camera);
  EXPECT_EQ(config.hello.head, "anna");
}

}  // namespace
}  // namespace strandcast::view_options_test
