#include "client/window/hud.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <filesystem>
#include <span>
#include <string>
#include <utility>

namespace strandcast {
namespace {

// In letters' heights: all sizes follow the font.
constexpr float kMarginLetters = 0.8f;
constexpr float kLabelLetters = 7.0f;
constexpr float kKeyLetters = 9.5f;
constexpr float kBannerLetters = 34.0f;
constexpr float kSpeedLetters = 6.0f;
constexpr float kPanelAlpha = 0.6f;
constexpr float kSolidAlpha = 0.92f;
constexpr float kFontPx = 15.0f;
const ImVec4 kTextColor(0.92f, 0.93f, 0.95f, 1.0f);
const ImVec4 kLabelColor(0.62f, 0.66f, 0.72f, 1.0f);
const ImVec4 kWarningColor(1.0f, 0.78f, 0.35f, 1.0f);
const ImVec4 kHelpColor(0.62f, 0.85f, 1.0f, 1.0f);
constexpr float kWayLetters = 22.0f;
constexpr float kWayHeightLetters = 0.6f;
/// Of parts of a bar; neighbours differ in brightness, too.
const std::array<ImVec4, 5> kWayColors{{{0.95f, 0.62f, 0.30f, 1.0f},
                                        {0.98f, 0.86f, 0.45f, 1.0f},
                                        {0.45f, 0.72f, 0.98f, 1.0f},
                                        {0.55f, 0.88f, 0.62f, 1.0f},
                                        {0.80f, 0.62f, 0.95f, 1.0f}}};

/// Usual on desktops, the first that is there; without any the small font of the library serves.
constexpr std::array<const char*, 4> kFonts{
    "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf",
    "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf",
    "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf"};

constexpr ImGuiWindowFlags kPanelFlags =
    ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings |
    ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav | ImGuiWindowFlags_NoInputs;

float letters(float count) {
  return count * ImGui::GetFontSize();
}

/// Where a panel is and how wide it may become.
struct Place {
  ImVec2 at;
  ImVec2 pivot;
  float max_width;
  float alpha;
};

Place in_the_middle(float max_width, float alpha) {
  const ImVec2 area = ImGui::GetIO().DisplaySize;
  const float inside = area.x - 2.0f * letters(kMarginLetters);
  return {{area.x * 0.5f, area.y * 0.5f}, {0.5f, 0.5f}, std::min(max_width, inside), alpha};
}

template <class Content>
PanelSize panel(const char* name, const Place& place, Content&& content) {
  ImGui::SetNextWindowPos(place.at, ImGuiCond_Always, place.pivot);
  ImGui::SetNextWindowSizeConstraints(ImVec2(0.0f, 0.0f), ImVec2(place.max_width, FLT_MAX));
  ImGui::SetNextWindowBgAlpha(place.alpha);
  PanelSize size;
  if (ImGui::Begin(name, nullptr, kPanelFlags)) {
    ImGui::PushTextWrapPos(place.max_width - ImGui::GetStyle().WindowPadding.x);
    content();
    ImGui::PopTextWrapPos();
    size = {ImGui::GetWindowWidth(), ImGui::GetWindowHeight()};
  }
  ImGui::End();
  return size;
}

void text(const ImVec4& color, const std::string& words) {
  if (words.empty()) return;
  ImGui::PushStyleColor(ImGuiCol_Text, color);
  ImGui::TextUnformatted(words.c_str());
  ImGui::PopStyleColor();
}

void row(const std::string& label, const std::string& value, float column) {
  text(kLabelColor, label);
  ImGui::SameLine(column);
  text(kTextColor, value);
}

/// Each part as long as it takes, and below what it is, in its colour, and all of it.
void draw_way(const std::vector<HudPart>& way, float max_width) {
  if (way.empty()) return;
  double total_ms = 0.0;
  for (const HudPart& part : way) total_ms += part.ms;
  const float padding = ImGui::GetStyle().WindowPadding.x;
  const float width = std::min(letters(kWayLetters), max_width - 2.0f * padding);
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float height = letters(kWayHeightLetters);
  float x = corner.x;
  for (size_t i = 0; i < way.size(); ++i) {
    const float part_width = total_ms > 0.0 ? width * static_cast<float>(way[i].ms / total_ms) : 0.0f;
    ImGui::GetWindowDrawList()->AddRectFilled(
        {x, corner.y}, {x + part_width, corner.y + height},
        ImGui::ColorConvertFloat4ToU32(kWayColors[i % kWayColors.size()]));
    x += part_width;
  }
  ImGui::Dummy({width, height});
  const float right = corner.x + max_width - 2.0f * padding;
  const auto word = [&](const ImVec4& color, const std::string& words, bool is_first) {
    if (!is_first) ImGui::SameLine();
    // What does not fit goes on in the next line.
    if (!is_first && ImGui::GetCursorScreenPos().x + ImGui::CalcTextSize(words.c_str()).x > right)
      ImGui::NewLine();
    text(color, words);
  };
  for (size_t i = 0; i < way.size(); ++i)
    word(kWayColors[i % kWayColors.size()], fmt::format("{} {:.1f}", way[i].name, way[i].ms), i == 0);
  word(kTextColor, fmt::format("= {:.1f} ms from motion to picture", total_ms), false);
}

}  // namespace

void set_panel_style(float content_scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 6.0f;
  style.WindowBorderSize = 0.0f;
  style.WindowPadding = ImVec2(10.0f, 8.0f);
  style.ItemSpacing = ImVec2(8.0f, 4.0f);
  style.ScaleAllSizes(content_scale);
  ImGuiIO& io = ImGui::GetIO();
  std::error_code ignored;
  for (const char* file : kFonts)
    if (std::filesystem::is_regular_file(file, ignored) &&
        io.Fonts->AddFontFromFileTTF(file, kFontPx * content_scale) != nullptr)
      return;
  io.FontGlobalScale = content_scale;
}

PanelSize draw_hud_panel(const HudState& hud, HudFold fold) {
  if (fold == HudFold::Hidden) return {};
  const float margin = letters(kMarginLetters);
  const float max_width =
      std::max(ImGui::GetIO().DisplaySize.x * kMaxPanelShare, letters(kMinPanelLetters)) - margin;
  return panel("measurements", {{margin, margin}, {0.0f, 0.0f}, max_width, kPanelAlpha}, [&] {
    text(kTextColor, hud.title);
    for (const std::string& warning : hud.warnings) text(kWarningColor, warning);
    const std::string keys = hud.timeline ? "H help   " : "H help   L look   ";
    if (fold == HudFold::Small) return text(kLabelColor, keys + "U details");
    ImGui::Spacing();
    draw_way(hud.way, max_width);
    for (const HudRow& entry : hud.rows) row(entry.label, entry.value, letters(kLabelLetters));
    text(kLabelColor, keys + "U hides this");
  });
}

PanelSize draw_help_panel(HelpTopic topic) {
  using Row = std::pair<const char*, const char*>;
  static constexpr std::array<Row, 4> kView{{
      {"left drag", "turn about the head"},
      {"middle, right drag", "move the view"},
      {"wheel", "closer, farther"},
      {"R", "back to the first view"},
  }};
  static constexpr std::array<Row, 6> kServer{{
      {"Space", "pause or resume the server"},
      {"N", "one simulation step"},
      {"P", "newest state or smooth playout"},
      {"M", "auto, strands drawn here, or the server's pictures"},
      {"L", "look of the hair: colours, style, light; save it as a scene"},
      {"F9", "begin a recording on the server, or end it"},
  }};
  static constexpr std::array<Row, 5> kRecording{{
      {"Space", "play or pause"},
      {"Left, Right", "the state before or after"},
      {"Home, End", "the beginning, the end"},
      {"Up, Down", "twice or half as fast"},
      {"O", "begin anew at the end, or stop there"},
  }};
  static constexpr std::array<Row, 5> kAll{{
      {"V", "hair, or what its drawing is made of: tangents, density, shadow, layers, tiles"},
      {"S", "save a picture"},
      {"U", "details, nothing, or one line in the corner"},
      {"H, F1", "this help"},
      {"Esc, Q", "quit"},
  }};
  const std::span<const Row> own = topic == HelpTopic::Recording ? std::span<const Row>(kRecording) : kServer;
  return panel("help", in_the_middle(letters(kBannerLetters), kSolidAlpha), [&] {
    for (const std::span<const Row> rows : {std::span<const Row>(kView), own, std::span<const Row>(kAll)})
      for (const auto& [key, meaning] : rows) row(key, meaning, letters(kKeyLetters));
  });
}

PanelSize draw_timeline(const TimelineState& timeline, TimelineActions& actions) {
  const ImVec2 area = ImGui::GetIO().DisplaySize;
  const float margin = letters(kMarginLetters);
  const float width = area.x - 2.0f * margin;
  ImGui::SetNextWindowPos({margin, area.y - margin}, ImGuiCond_Always, {0.0f, 1.0f});
  ImGui::SetNextWindowSize({width, 0.0f});
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  constexpr ImGuiWindowFlags kFlags =
      ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoNav;
  PanelSize size;
  if (ImGui::Begin("timeline", nullptr, kFlags)) {
    if (ImGui::Button(timeline.is_playing ? "Pause" : " Play ")) actions.wants_play_toggle = true;
    ImGui::SameLine();
    bool is_looping = timeline.is_looping;
    if (ImGui::Checkbox("loop", &is_looping)) actions.wants_loop_toggle = true;
    ImGui::SameLine();
    ImGui::SetNextItemWidth(letters(kSpeedLetters));
    auto speed = static_cast<float>(timeline.speed);
    if (ImGui::SliderFloat("##speed", &speed, 1.0f / 16.0f, 8.0f, "%.3gx", ImGuiSliderFlags_Logarithmic))
      actions.speed = speed;
    ImGui::SameLine();
    ImGui::SetNextItemWidth(-1.0f);
    auto time_s = static_cast<float>(timeline.time_s);
    const std::string shown = fmt::format("{:.2f} of {:.2f} s", timeline.time_s, timeline.length_s);
    if (ImGui::SliderFloat("##time", &time_s, 0.0f, static_cast<float>(timeline.length_s), shown.c_str()))
      actions.time_s = time_s;
    size = {ImGui::GetWindowWidth(), ImGui::GetWindowHeight()};
  }
  ImGui::End();
  return size;
}

PanelSize draw_banner(const HudBanner& banner) {
  return panel("connection", in_the_middle(letters(kBannerLetters), kSolidAlpha), [&] {
    text(kTextColor, banner.headline);
    text(kWarningColor, banner.trouble);
    text(kHelpColor, banner.help);
    text(kLabelColor, banner.doing);
  });
}

}  // namespace strandcast
