// How large the panels of the window become, laid out without any OpenGL, and what they say.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <imgui.h>

#include "client/app/view_hud.h"
#include "client/window/hud.h"
#include "common/base/units.h"

namespace strandcast::hud_panel_test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;

/// Dear ImGui without a window.
class PanelBench {
 public:
  explicit PanelBench(float scale) {
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    set_panel_style(scale);
    ImGui::GetIO().Fonts->Build();
  }
  ~PanelBench() { ImGui::DestroyContext(); }
  PanelBench(const PanelBench&) = delete;
  PanelBench& operator=(const PanelBench&) = delete;

  /// The size of a panel on an area of this size, once it knows what it holds.
  template <class Panel>
  PanelSize lay_out(const ImVec2& area, const Panel& panel) const {
    PanelSize size;
    for (int turn = 0; turn < 3; ++turn) {
      ImGui::GetIO().DisplaySize = area;
      ImGui::NewFrame();
      size = panel();
      ImGui::EndFrame();
    }
    return size;
  }
};

/// Everything there is to say, at length.
HudState talkative_hud() {
  HudState hud;
  hud.title = std::string(200, 'W');
  hud.warnings = {std::string(200, 'w'),
                  "no head motion arrives at the server and much more is to be said of it"};
  for (int i = 0; i < 16; ++i)
    hud.rows.push_back({"because", std::string(30, 'm') + " " + std::string(120, 'n')});
  hud.way = {
      {"simulated", 4.0}, {"encoded", 1234.5}, {"on its way", 0.0}, {"decoded", 2.0}, {"presented", 99999.0}};
  return hud;
}

TEST(HudPanel, TakesNoMoreThanAThirdOfTheWidthWhateverItSays) {
  for (const float scale : {1.0f, 2.0f}) {
    PanelBench bench(scale);
    for (const float width : {1280.0f, 1920.0f, 2560.0f})
      for (const HudFold fold : {HudFold::Small, HudFold::Unfolded}) {
        const PanelSize size = bench.lay_out({width * scale, 720.0f * scale},
                                             [&] { return draw_hud_panel(talkative_hud(), fold); });
        EXPECT_GT(size.width, 0.0f);
        EXPECT_LE(size.width, width * scale * kMaxPanelShare);
      }
  }
}

TEST(HudPanel, IsTwoLinesUntilItIsUnfolded) {
  PanelBench bench(1.0f);
  HudState hud;
  hud.title = "default: strands, 10 pictures/s";
  hud.rows.assign(14, {"label", "value"});
  const auto lay_out = [&](HudFold fold) {
    return bench.lay_out({1280.0f, 720.0f}, [&] { return draw_hud_panel(hud, fold); });
  };
  const PanelSize small = lay_out(HudFold::Small);
  // Two lines of 15 px, what is between them and the border of 8 px.
  EXPECT_LE(small.height, 2 * 15.0f + 4.0f + 2 * 8.0f + 6.0f);
  EXPECT_LE(small.width, 1280.0f / 4.0f);
  EXPECT_GT(lay_out(HudFold::Unfolded).height, 15 * 15.0f);
  EXPECT_EQ(lay_out(HudFold::Hidden).height, 0.0f);
}

TEST(HudPanel, HelpAndBannerStayInsideASmallWindow) {
  PanelBench bench(1.0f);
  const HudBanner banner{"connecting to 127.0.0.1:7878", std::string(300, 'x'), "look there", "trying again"};
  const PanelSize shown = bench.lay_out({320.0f, 240.0f}, [&] { return draw_banner(banner); });
  EXPECT_LE(shown.width, 320.0f);
  const PanelSize wide = bench.lay_out({1280.0f, 720.0f}, [&] { return draw_banner(banner); });
  EXPECT_GT(shown.height, wide.height) << "what does not fit in a line goes on in the next";
  EXPECT_LE(bench.lay_out({320.0f, 240.0f}, [] { return draw_help_panel(HelpTopic::Server); }).width, 320.0f);
}

// Three lines at most, of a bar and of what its parts are; nothing where nothing was measured.
TEST(HudPanel, TheWayIsABarWithItsParts) {
  PanelBench bench(1.0f);
  HudState hud;
  hud.title = "default";
  const auto height = [&] {
    return bench.lay_out({1280.0f, 720.0f}, [&] { return draw_hud_panel(hud, HudFold::Unfolded); }).height;
  };
  const float without = height();
  hud.way = {{"simulated", 0.0}, {"presented", 0.0}};
  const float with = height();
  EXPECT_GT(with, without + 15.0f);
  EXPECT_LT(with, without + 4 * 19.0f);
  hud.way.clear();
  EXPECT_EQ(height(), without);
}

TEST(HudFold, GoesRound) {
  HudFold fold = HudFold::Small;
  fold = next_fold(fold);
  EXPECT_EQ(fold, HudFold::Unfolded);
  fold = next_fold(fold);
  EXPECT_EQ(fold, HudFold::Hidden);
  EXPECT_EQ(next_fold(fold), HudFold::Small);
}

ViewFacts facts_of(const char* address) {
  ViewFacts facts;
  facts.address = *parse_address(address);
  return facts;
}

TEST(ViewHud, SaysWhatIsTriedInsteadOfBlack) {
  HudWriter writer;
  ViewerState state;
  ViewFacts facts = facts_of("127.0.0.1:7878");
  facts.is_starting = true;
  auto hud = writer.write(state, facts, kSInNs);
  ASSERT_TRUE(hud.banner);
  EXPECT_EQ(hud.banner->headline, "starting");
  facts.is_starting = false;
  state.doing = "looking for the host";
  hud = writer.write(state, facts, kSInNs);
  EXPECT_EQ(hud.banner->headline, "connecting to 127.0.0.1:7878");
  EXPECT_THAT(hud.banner->doing, HasSubstr("looking for the host"));
  EXPECT_EQ(hud.banner->trouble, "");
  state.trouble = "127.0.0.1:7878: cannot connect: Connection refused";
  state.help = "start it";
  hud = writer.write(state, facts, kSInNs);
  EXPECT_EQ(hud.banner->trouble, "cannot connect: Connection refused");
  EXPECT_EQ(hud.banner->help, "start it");
  state.session_number = 1;
  EXPECT_THAT(writer.write(state, facts, kSInNs).banner->headline, HasSubstr("connection lost"));
  state.final_error = make_error(ErrorCode::Unauthorized, "The token is wrong or missing.");
  EXPECT_EQ(writer.write(state, facts, kSInNs).banner->doing, "Esc quits");
  state.is_connected = true;
  EXPECT_FALSE(writer.write(state, facts, kSInNs).banner);
}

TEST(ViewHud, SaysWhatIsShownBetweenStates) {
  HudWriter writer;
  ViewerState state;
  state.is_connected = true;
  state.session_number = 1;
  ViewFacts facts = facts_of("127.0.0.1");
  facts.interpolation = Interpolation::Cubic;
  const auto row = [](const std::string& value) {
    return AllOf(Field(&HudRow::label, std::string("interpolation")), Field(&HudRow::value, value));
  };
  EXPECT_THAT(writer.write(state, facts, kSInNs).rows, testing::Not(Contains(row("cubic"))))
      << "the newest state is shown";
  facts.playout = Playout::Smooth;
  EXPECT_THAT(writer.write(state, facts, kSInNs).rows, Contains(row("cubic")));
  facts.interpolation = Interpolation::Linear;
  EXPECT_THAT(writer.write(state, facts, kSInNs).rows, Contains(row("linear")));
  ViewReport report = {{"interpolation", "none", false}, {"linear_pictures", "0"}, {"cubic_pictures", "0"}};
  set_interpolation(report, 0, 0);
  EXPECT_THAT(to_lines(report), HasSubstr("interpolation=none\n"));
  set_interpolation(report, 3, 2);
  EXPECT_EQ(to_lines(report), "interpolation=linear\nlinear_pictures=3\ncubic_pictures=2\n");
  set_interpolation(report, 3, 4);
  EXPECT_THAT(to_lines(report), HasSubstr("interpolation=cubic\n"));
}

TEST(ViewHud, SaysWhatAPersonShouldKnow) {
  HudWriter writer;
  ViewerState state;
  state.is_connected = state.has_status = true;
  state.session_number = 1;
  state.welcome.scene_name = "stage";
  state.status.realtime_factor = 1.0;
  state.status.is_motion_stale = false;
  const ViewFacts facts = facts_of("127.0.0.1");
  EXPECT_TRUE(writer.write(state, facts, kSInNs).warnings.empty());
  state.status.is_paused = state.status.is_motion_stale = true;
  EXPECT_THAT(writer.write(state, facts, kSInNs).warnings,
              AllOf(Contains(HasSubstr("paused")), Contains(HasSubstr("no head motion"))));
  state.status.is_paused = state.status.is_motion_stale = false;
  state.status.recording = "take 5.mcap: 12.5 s, 3.2 MB";
  EXPECT_THAT(writer.write(state, facts, kSInNs).warnings,
              testing::ElementsAre("recording take 5.mcap: 12.5 s, 3.2 MB"));
  state.status.recording.clear();
  state.status.realtime_factor = 0.6;
  EXPECT_TRUE(writer.write(state, facts, kSInNs + kSlowMotionNs - 1).warnings.empty())
      << "not for long enough";
  EXPECT_THAT(writer.write(state, facts, kSInNs + kSlowMotionNs).warnings, Contains(HasSubstr("x0.60")));
  state.status.slow_motion = "Slow motion: this helps.";
  EXPECT_THAT(writer.write(state, facts, kSInNs + kSlowMotionNs).warnings,
              testing::ElementsAre("Slow motion: this helps."))
      << "the server knows more";
  state.status.slow_motion.clear();
  state.status.realtime_factor = kSlowMotion;
  EXPECT_TRUE(writer.write(state, facts, kSInNs + 2 * kSlowMotionNs).warnings.empty());
}

TEST(ViewHud, SaysTimecodeAndWhatItCounts) {
  HudWriter writer;
  ViewerState state;
  state.is_connected = true;
  state.session_number = 1;
  const auto timecode = [&] {
    for (const HudRow& row : writer.write(state, facts_of("127.0.0.1"), kSInNs).rows)
      if (row.label == "timecode") return row.value;
    return std::string("no row");
  };
  EXPECT_EQ(timecode(), "no row");
  state.status.timecode = *parse_timecode("01:02:03:04", {25, 1});
  EXPECT_EQ(timecode(), "01:02:03:04 at 25 fps");
  state.status.timecode = *parse_timecode("01:02:03;04", {30000, 1001});
  EXPECT_EQ(timecode(), "01:02:03;04 at 29.97 fps");
}

TEST(ViewHud, SaysWhatSimulates) {
  HudWriter writer;
  ViewerState state;
  state.is_connected = true;
  state.session_number = 1;
  const auto device = [&] {
    for (const HudRow& row : writer.write(state, facts_of("127.0.0.1"), kSInNs).rows)
      if (row.label == "simulated by") return row.value;
    return std::string("no row");
  };
  EXPECT_EQ(device(), "no row") << "an older server does not say";
  state.welcome.sim_device = "lanes (AVX2, 4 threads)";
  EXPECT_EQ(device(), "lanes (AVX2, 4 threads)");
}

TEST(ViewHud, SaysWhichCodecStrandsComeByAndWhy) {
  HudWriter writer;
  ViewerState state;
  state.is_connected = true;
  state.session_number = 1;
  state.welcome.codec = "tangent";
  const auto value_of = [&](const std::string& label) {
    for (const HudRow& row : writer.write(state, facts_of("127.0.0.1"), kSInNs).rows)
      if (row.label == label) return row.value;
    return std::string("no row");
  };
  const auto codec = [&] { return value_of("strands by"); };
  EXPECT_EQ(codec(), "tangent") << "an older server gives no reason";
  state.welcome.codec_reason = "tangent: asked for";
  EXPECT_EQ(codec(), "tangent: asked for");
  EXPECT_EQ(value_of("exact"), "no row");
  state.exact_share = 0.983;
  EXPECT_EQ(value_of("exact"), "98.3 % of the frames");
  state.mode.shown = StreamMode::Frames;
  EXPECT_EQ(codec(), "no row");
}

TEST(ViewHud, SaysWhoseLookIsSeen) {
  HudWriter writer;
  ViewerState state;
  state.is_connected = true;
  state.session_number = 1;
  state.look.look.hair_color = "red";
  ViewFacts facts = facts_of("127.0.0.1");
  const auto look = [&] {
    for (const HudRow& row : writer.write(state, facts, kSInNs).rows)
      if (row.label == "look") return row.value;
    return std::string("no row");
  };
  EXPECT_EQ(look(), "red (L)");
  state.look_changes = 2;
  EXPECT_EQ(look(), "red, changed 2 times (L)");
  facts.has_own_look = true;
  EXPECT_THAT(look(), HasSubstr("your own"));
  state.mode.shown = StreamMode::Frames;
  EXPECT_THAT(look(), HasSubstr("red")) << "the server's pictures show the scene's";
}

TEST(ViewHud, CountsPicturesAndSaysHowTheyAreDrawn) {
  HudWriter writer;
  ViewerState state;
  state.is_connected = true;
  state.session_number = 1;
  state.welcome.scene_name = "stage";
  ViewFacts facts = facts_of("127.0.0.1");
  EXPECT_EQ(writer.write(state, facts, kSInNs).title, "stage: strands, nothing moves");
  facts.shown_count = 25;
  facts.draw_step = kCoarsestFairStep;
  const HudState hud = writer.write(state, facts, 3 * kSInNs);
  EXPECT_EQ(hud.title, "stage: strands, 12 pictures/s");
  EXPECT_THAT(hud.rows, Contains(AllOf(Field(&HudRow::label, "drawn"),
                                       Field(&HudRow::value, HasSubstr("50 % of the sides")))));
}

}  // namespace
}  // namespace strandcast::hud_panel_test
