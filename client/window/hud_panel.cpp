#include "client/window/hud_panel.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <filesystem>
#include <utility>

namespace strandcast {
namespace {

// In letters' heights: all sizes follow the font.
constexpr float kMarginLetters = 0.8f;
constexpr float kLabelLetters = 7.0f;
constexpr float kKeyLetters = 9.5f;
constexpr float kBannerLetters = 34.0f;
constexpr float kPanelAlpha = 0.6f;
constexpr float kSolidAlpha = 0.92f;
constexpr float kFontPx = 15.0f;
const ImVec4 kTextColor(0.92f, 0.93f, 0.95f, 1.0f);
const ImVec4 kLabelColor(0.62f, 0.66f, 0.72f, 1.0f);
const ImVec4 kWarningColor(1.0f, 0.78f, 0.35f, 1.0f);
const ImVec4 kHelpColor(0.62f, 0.85f, 1.0f, 1.0f);

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
    if (fold == HudFold::Small) return text(kLabelColor, "H help   L look   U details");
    ImGui::Spacing();
    for (const HudRow& entry : hud.rows) row(entry.label, entry.value, letters(kLabelLetters));
    text(kLabelColor, "H help   L look   U hides this");
  });
}

PanelSize draw_help_panel() {
  static constexpr std::array<std::pair<const char*, const char*>, 14> kHelp{{
      {"left drag", "turn about the head"},
      {"middle, right drag", "move the view"},
      {"wheel", "closer, farther"},
      {"R", "back to the first view"},
      {"Space", "pause or resume the server"},
      {"N", "one simulation step"},
      {"P", "newest state or smooth playout"},
      {"M", "auto, strands drawn here, or the server's pictures"},
      {"L", "look of the hair: colours, style, light; save it as a scene"},
      {"V", "hair, or what its drawing is made of: tangents, density, shadow, layers, tiles"},
      {"S", "save a picture"},
      {"U", "details, nothing, or one line in the corner"},
      {"H, F1", "this help"},
      {"Esc, Q", "quit"},
  }};
  return panel("help", in_the_middle(letters(kBannerLetters), kSolidAlpha), [&] {
    for (const auto& [key, meaning] : kHelp) row(key, meaning, letters(kKeyLetters));
  });
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
