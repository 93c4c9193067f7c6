// Recordings played, scrubbed, drawn and exported: what is shown of a moment is the same however one came
// there.
#include <algorithm>
#include <cmath>

#include "client/app/playback_clock.h"
#include "client/app/recording_film.h"
#include "client/app/recording_player.h"
#include "client/export/export_strands.h"
#include "common/base/file.h"
#include "common/base/hash.h"
#include "common/base/units.h"
#include "common/pictures/video_codec.h"
#include "common/pictures/webm_writer.h"
#include "common/record/record_file.h"
#include "common/record/recording_writer.h"
#include "common/scene/scene_file.h"
#include "tests/support/sample_asset.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_pictures.h"

namespace strandcast::recording_player_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr uint32_t kStrands = 9, kVertices = 4;
constexpr int kStates = 151;
constexpr int kStatesPerKeyframe = 60;
constexpr int64_t kStepNs = 16'666'667;
constexpr int64_t kFirstNs = 3'000'000'000;  // of a server that had run for a while
constexpr float kQuantumM = 1e-5f;
using Direction = RecordingPlayer::Direction;

SceneAsset asset_of_strands() {
  return sample_asset(kStrands, kVertices);
}
/// Strands that swing as cubics of time do.
std::vector<glm::vec3> positions_at(double t_s) {
  std::vector<glm::vec3> positions = asset_of_strands().rest_position_m;
  for (size_t i = 0; i < positions.size(); ++i) {
    const double swing = static_cast<double>(i / kStrands) * (0.02 * t_s - 0.01 * t_s * t_s);
    positions[i] += glm::vec3(swing, 0.3 * swing, -0.2 * swing);
  }
  return positions;
}
Snapshot state(int index) {
  const double t_s = static_cast<double>(index * kStepNs) * 1e-9;
  const std::vector<glm::vec3> positions = positions_at(t_s);
  QuantiseInput input;
  input.tick = static_cast<uint64_t>(index) + 180;
  input.sim_time_ns = kFirstNs + index * kStepNs;
  input.world_from_head = {{0.1 * t_s, 1.6, 0.0}, glm::angleAxis(0.3 * t_s, glm::dvec3(0, 1, 0))};
  input.strand_count = kStrands;
  input.vertex_count = kVertices;
  input.quantum_m = kQuantumM;
  input.position_in_head_m = positions;
  return quantise(input).snapshot;
}

std::filesystem::path make_recording(const TemporaryFolder& folder) {
  const std::filesystem::path path = folder.path() / "run.mcap";
  auto file = RecordFile::make(path, IfPresent::Refuse).value();
  file->keep();
  FrameHeader header;
  header.opcode = Opcode::Asset;
  header.sequence = 1;
  const std::vector<std::byte> payload = encode_scene_asset(asset_of_strands());
  RecordingStart start;
  start.codec = "delta";
  start.scene_text = to_line(built_in_scene());
  start.asset_hash = hash_bytes(payload);
  RecordingWriter writer(*file, start, *make_encoded_frame(header, payload));
  auto encoder = make_strand_encoder("delta").value();
  for (int i = 0; i < kStates; ++i) {
    const int64_t time_ns = start.server_time_ns + i * kStepNs;
    if (i == kStates / 2) {
      LookChange look{built_in_scene().look, built_in_scene().camera};
      look.look.exposure = 2.0f;
      writer.add(time_ns, kFirstNs + i * kStepNs, look);
    }
    const JoinFrames frames = encoder->encode_for_join(state(i));
    writer.add(time_ns, i % kStatesPerKeyframe == 0 ? *frames.keyframe : *frames.frame);
  }
  writer.finish();
  file->finish();
  EXPECT_FALSE(file->failure());
  return path;
}

class Recorded : public testing::Test {
 protected:
  std::unique_ptr<RecordingPlayer> player() const {
    auto player = RecordingPlayer::open(path);
    EXPECT_TRUE(player) << player.error().to_string();
    return std::move(player).value();
  }
  TemporaryFolder folder;
  const std::filesystem::path path = make_recording(folder);
};

TEST_F(Recorded, StatesComeBackAsTheyWere) {
  const auto states = RecordedStates::open(path);
  ASSERT_TRUE(states) << states.error().to_string();
  EXPECT_EQ((*states)->scene().strand_radius_m, built_in_scene().look.strand_radius_m);
  for (int i = 0; i < kStates; ++i) {
    const auto found = (*states)->next();
    ASSERT_TRUE(found && *found) << i;
    EXPECT_EQ(state_hash(**found), state_hash(state(i))) << i;
  }
  EXPECT_EQ(*(*states)->next(), nullptr);
  EXPECT_TRUE((*states)->remarks().empty());
  EXPECT_EQ((*states)->look().look.exposure, 2.0f);
}

TEST_F(Recorded, AMomentIsTheSameHoweverOneCameThere) {
  const auto on = player();
  EXPECT_NEAR(on->length_s(), (kStates - 1) * kStepNs * 1e-9, 1e-9);
  std::vector<double> times;
  std::vector<PosedStrands> played;
  for (double t_s = 0.0; t_s <= on->length_s(); t_s += 0.037) {
    times.push_back(t_s);
    played.push_back(on->strands_at(t_s).value());
    const auto exact = positions_at(t_s);
    for (size_t v = 0; v < exact.size(); ++v)
      EXPECT_LT(glm::distance(played.back().position_m[v], exact[v]), 2.0f * kQuantumM) << t_s;
  }
  const auto scrubbed = player();
  for (size_t i = times.size(); i-- > 0;) {
    const PosedStrands back = scrubbed->strands_at(times[i]).value();
    EXPECT_EQ(back.position_m, played[i].position_m) << times[i];
    EXPECT_EQ(back.world_from_head, played[i].world_from_head);
  }
  for (const size_t i : {size_t{3}, times.size() - 2, size_t{20}, size_t{0}})
    EXPECT_EQ(scrubbed->strands_at(times[i])->position_m, played[i].position_m);
}

TEST_F(Recorded, LooksGoBackWithTheMoment) {
  const auto scrubbed = player();
  const float before = built_in_scene().look.exposure;
  for (const auto& [time_s, exposure] : {std::pair(2.0, 2.0f), {0.5, before}, {1.5, 2.0f}, {0.0, before}}) {
    ASSERT_TRUE(scrubbed->strands_at(time_s));
    EXPECT_EQ(scrubbed->look().look.exposure, exposure) << time_s;
  }
}

TEST_F(Recorded, ArrowKeysGoFromStateToState) {
  const auto states = player();
  double t_s = 1.0;
  for (int i = 60; i < 140; ++i) {
    t_s = states->time_beside(t_s, Direction::On).value();
    EXPECT_NEAR(t_s, static_cast<double>(i * kStepNs) * 1e-9, 1e-9);
  }
  const double end_s = t_s;
  for (int i = 0; i < 130; ++i) {
    const double before_s = states->time_beside(t_s, Direction::Back).value();
    EXPECT_NEAR(t_s - before_s, kStepNs * 1e-9, 1e-9) << i;
    t_s = before_s;
  }
  EXPECT_NEAR(end_s - t_s, 130 * kStepNs * 1e-9, 1e-6);
  EXPECT_EQ(states->time_beside(0.0, Direction::Back).value(), 0.0);
  EXPECT_EQ(states->time_beside(states->length_s(), Direction::On).value(), states->length_s());
}

TEST_F(Recorded, AnExportFromTheMiddleIsThatOfTheWhole) {
  const auto exported = [&](double from_s, const char* name) {
    ExportOptions options;
    options.path = folder.path() / name;
    options.from_s = from_s;
    options.to_s = 2.25;
    options.is_quiet = true;
    auto states = RecordedStates::open(path).value();
    const auto report = export_strands(*states, options, std::atomic<bool>(false));
    EXPECT_TRUE(report) << report.error().to_string();
    EXPECT_NEAR(report->first_s, 3.0 + from_s, 1e-9);
    return *load_text(options.path, 1 << 24);
  };
  // Cells behind the frame's number: that counts from the beginning of each file.
  const auto rows = [](const std::string& text) {
    std::vector<std::string> found;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
      if (!line.starts_with("0,") && !line.starts_with("frame")) found.push_back(line.substr(line.find(',')));
    return found;
  };
  const auto whole = rows(exported(0.0, "whole.csv")), part = rows(exported(1.5, "part.csv"));
  ASSERT_GT(part.size(), 20u * kStrands * kVertices);
  EXPECT_TRUE(std::equal(part.rbegin(), part.rend(), whole.rbegin()));
}

/// Elements of a Matroska file or part: those that hold others are walked into.
void walk(std::string_view bytes, std::vector<std::pair<uint64_t, std::string_view>>& elements) {
  const auto number = [&](size_t count, bool keeps_mark) {
    uint64_t value = 0;
    for (size_t i = 0; i < count; ++i) value = value << 8 | static_cast<uint8_t>(bytes[i]);
    if (!keeps_mark) value &= (1ull << (7 * count)) - 1;
    bytes.remove_prefix(count);
    return value;
  };
  const auto length = [&] {
    return static_cast<size_t>(std::countl_zero(static_cast<uint8_t>(bytes[0]))) + 1;
  };
  while (!bytes.empty()) {
    const uint64_t id = number(length(), true);
    const uint64_t size = number(length(), false);
    ASSERT_LE(size, bytes.size()) << std::hex << id;
    const std::string_view content = bytes.substr(0, size);
    bytes.remove_prefix(size);
    elements.emplace_back(id, content);
    const bool holds_others = id == 0x1A45DFA3 || id == 0x18538067 || id == 0x1549A966 || id == 0x1654AE6B ||
                              id == 0xAE || id == 0xE0 || id == 0x1F43B675 || id == 0x1C53BB6B ||
                              id == 0xBB || id == 0xB7;
    if (holds_others) walk(content, elements);
  }
}

TEST(WebmWriter, HoldsPicturesThatDecodeAtTheirTimes) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "film.webm";
  constexpr uint32_t kWidth = 160, kHeight = 96;
  constexpr int kPictures = 61;
  constexpr double kFps = 25.0;
  auto writer = WebmWriter::make(path, {kWidth, kHeight, kFps});
  ASSERT_TRUE(writer) << writer.error().to_string();
  for (int i = 0; i < kPictures; ++i) ASSERT_TRUE(writer->add(test::waving_lines(kWidth, kHeight, 0.02 * i)));
  EXPECT_FALSE(std::filesystem::exists(path));
  ASSERT_TRUE(writer->finish());
  const std::string bytes = *load_text(path, 1 << 24);
  std::vector<std::pair<uint64_t, std::string_view>> elements;
  walk(bytes, elements);
  EXPECT_EQ(elements.front().first, 0x1A45DFA3u);
  const auto value = [](std::string_view content) {
    uint64_t number = 0;
    for (const char c : content) number = number << 8 | static_cast<uint8_t>(c);
    return number;
  };
  auto decoder = make_video_decoder(PictureCodec::Vp8).value();
  uint64_t cluster_ms = 0, segment_at = 0;
  int pictures = 0;
  std::vector<uint64_t> clusters_at;
  for (const auto& [id, content] : elements) {
    const auto at = static_cast<uint64_t>(content.data() - bytes.data());
    if (id == 0x18538067) segment_at = at;
    if (id == 0x4282) {
      EXPECT_EQ(content, "webm");
    }
    if (id == 0x86) {
      EXPECT_EQ(content, "V_VP8");
    }
    if (id == 0xB0) {
      EXPECT_EQ(value(content), kWidth);
    }
    if (id == 0xBA) {
      EXPECT_EQ(value(content), kHeight);
    }
    if (id == 0x4489) {
      EXPECT_EQ(std::bit_cast<double>(value(content)), 1000.0 * kPictures / kFps);
    }
    if (id == 0x1F43B675) clusters_at.push_back(at - 12 - segment_at);  // 4 of its id, 8 of its size
    if (id == 0xE7) cluster_ms = value(content);
    if (id == 0xF1) {
      EXPECT_NE(std::find(clusters_at.begin(), clusters_at.end(), value(content)), clusters_at.end());
    }
    if (id != 0xA3) continue;
    EXPECT_EQ(cluster_ms + value(content.substr(1, 2)),
              static_cast<uint64_t>(std::lround(1000.0 * pictures / kFps)));
    const auto frame = std::as_bytes(std::span(content.substr(4)));
    EXPECT_EQ((content[3] & '\x80') != 0, read_video_info(PictureCodec::Vp8, frame)->is_keyframe);
    const auto image = decoder->decode(frame);
    ASSERT_TRUE(image) << image.error().to_string();
    const Image original = test::waving_lines(kWidth, kHeight, 0.02 * pictures);
    double squares = 0.0;
    for (size_t i = 0; i < original.rgba.size(); ++i)
      squares += std::pow(static_cast<double>(image->rgba[i]) - original.rgba[i], 2.0);
    EXPECT_LT(std::sqrt(squares / static_cast<double>(original.rgba.size())), 40.0) << pictures;
    ++pictures;
  }
  EXPECT_EQ(pictures, kPictures);
  EXPECT_EQ(clusters_at.size(), 2u) << "one in two seconds";
}

TEST_F(Recorded, IsDrawnIntoAFilmOrPictures) {
  ViewOptions options;
  options.recording = path;
  options.drawing.renderer = "tiles";
  options.size = {64, 48};
  options.film_fps = 10.0;
  options.seconds = 0.5;
  const std::atomic<bool> never{false};
  for (const char* const name : {"film.webm", "film.webp", "frames/%03d.png"}) {
    options.film = folder.path() / name;
    const auto made = run_film(options, never);
    ASSERT_TRUE(made) << made.error().to_string();
    EXPECT_THAT(*made, HasSubstr("6 frames of 64x48 at 10 fps"));
  }
  EXPECT_GT(std::filesystem::file_size(folder.path() / "film.webm"), 500u);
  const auto first = load_png(folder.path() / "frames/001.png"),
             last = load_png(folder.path() / "frames/006.png");
  ASSERT_TRUE(first && last);
  EXPECT_EQ(last->width, 64u);
  EXPECT_NE(first->rgba, last->rgba) << "the hair moves";
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "frames/007.png"));
}

TEST(RecordingFilm, NamesSayWhatIsMade) {
  EXPECT_TRUE(check_film_path("a.webm"));
  EXPECT_TRUE(check_film_path("a/b%d.png"));
  EXPECT_TRUE(check_film_path("%04d.png"));
  for (const char* const wrong : {"a.png", "a.mp4", "%s.png", "%d_%d.png", "%"})
    EXPECT_THAT(check_film_path(wrong).error().to_string(), HasSubstr("frames/%04d.png")) << wrong;
  EXPECT_EQ(numbered_path("a/b_%04d.png", 12), "a/b_0012.png");
  EXPECT_EQ(numbered_path("%d.png", 7), "7.png");
}

TEST(PlaybackClock, PlaysPausesLoopsAndGoesWhereItIsPut) {
  PlaybackClock clock(10.0);
  clock.advance(5 * kSInNs);
  EXPECT_EQ(clock.time_s(), 0.0) << "time begins with the first call";
  clock.advance(7 * kSInNs);
  EXPECT_DOUBLE_EQ(clock.time_s(), 2.0);
  clock.set_speed(2.0);
  clock.advance(8 * kSInNs);
  EXPECT_DOUBLE_EQ(clock.time_s(), 4.0);
  clock.toggle();
  clock.advance(20 * kSInNs);
  EXPECT_DOUBLE_EQ(clock.time_s(), 4.0);
  clock.toggle();
  clock.advance(30 * kSInNs);
  EXPECT_DOUBLE_EQ(clock.time_s(), 10.0);
  EXPECT_FALSE(clock.is_playing()) << "it stops at the end";
  clock.toggle();
  EXPECT_EQ(clock.time_s(), 0.0) << "and begins anew";
  clock.set_looping(true);
  clock.set_speed(1.0);
  clock.advance(42 * kSInNs);
  EXPECT_DOUBLE_EQ(clock.time_s(), 2.0);
  clock.go_to(-3.0);
  EXPECT_EQ(clock.time_s(), 0.0);
  clock.set_speed(1e9);
  EXPECT_EQ(clock.speed(), kFastestPlayback);
}

}  // namespace
}  // namespace strandcast::recording_player_test
