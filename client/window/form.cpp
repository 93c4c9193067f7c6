#include "client/window/form.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <utility>

namespace strandcast {
namespace {

constexpr double kDegPerRad = 57.29577951308232;
// IEC 61966-2-1, equations 5 to 8.
constexpr float kLinearEnd = 0.0031308f;
constexpr float kShownEnd = 0.04045f;
constexpr float kLinearSlope = 12.92f;
constexpr float kGamma = 2.4f;
constexpr float kOffset = 0.055f;

// In letters' heights.
constexpr float kFormLetters = 24.0f;
constexpr float kFormMarginLetters = 0.8f;
constexpr float kTitleShare = 0.42f;  // of the width
constexpr float kFormAlpha = 0.85f;
constexpr double kMaxAzimuthDeg = 180.0;
// Straight up and down has no azimuth to come back to.
constexpr double kMaxElevationDeg = 89.0;
constexpr double kWholeDigits = 100.0;  // numbers from here on need no decimals
const ImVec4 kTitleColor(0.92f, 0.93f, 0.95f, 1.0f);
const ImVec4 kNoteColor(0.62f, 0.85f, 1.0f, 1.0f);
const ImVec4 kFormLabelColor(0.62f, 0.66f, 0.72f, 1.0f);

constexpr ImGuiWindowFlags kFormFlags = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                                        ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                                        ImGuiWindowFlags_NoSavedSettings;

std::string number_format(const FormField& field) {
  const double reach = field.handy_maximum * field.shown_per_unit;
  const char* digits = reach >= kWholeDigits ? "%.0f" : reach > 10.0 ? "%.1f" : "%.3f";
  // What stands behind the number is a part of printf's format.
  return field.unit.empty() ? digits : std::string(digits) + " " + field.unit;
}

/// The value when it was moved.
std::optional<double> slider(const FormField& field, double value) {
  const double scale = field.shown_per_unit;
  double shown = value * scale;
  const double low = field.minimum * scale;
  const double high = field.handy_maximum * scale;
  const ImGuiSliderFlags flags = field.is_logarithmic ? ImGuiSliderFlags_Logarithmic : ImGuiSliderFlags_None;
  if (!ImGui::SliderScalar("##value", ImGuiDataType_Double, &shown, &low, &high, number_format(field).c_str(),
                           flags))
    return std::nullopt;
  return std::clamp(shown / scale, field.minimum, field.maximum);
}

std::optional<FormValue> draw_whole(const FormField& field) {
  int shown = static_cast<int>(std::lround(std::get<double>(field.value)));
  if (!ImGui::SliderInt("##value", &shown, static_cast<int>(field.minimum),
                        static_cast<int>(field.handy_maximum)))
    return std::nullopt;
  return std::clamp(static_cast<double>(shown), field.minimum, field.maximum);
}

/// What can be no brighter than white is picked as it will be seen; lights as numbers.
std::optional<FormValue> draw_color(const FormField& field) {
  const bool is_surface = field.maximum <= 1.0;
  glm::vec3 shown = std::get<glm::vec3>(field.value);
  if (is_surface) shown = {to_srgb(shown.r), to_srgb(shown.g), to_srgb(shown.b)};
  const ImGuiColorEditFlags flags =
      is_surface ? ImGuiColorEditFlags_Uint8 : ImGuiColorEditFlags_Float | ImGuiColorEditFlags_HDR;
  if (!ImGui::ColorEdit3("##value", &shown.x, flags)) return std::nullopt;
  if (is_surface) shown = {from_srgb(shown.r), from_srgb(shown.g), from_srgb(shown.b)};
  return glm::clamp(shown, static_cast<float>(field.minimum), static_cast<float>(field.maximum));
}

std::optional<FormValue> draw_direction(const FormField& field) {
  const glm::vec3 direction = std::get<glm::vec3>(field.value);
  const DirectionAngles angles = angles_of(direction);
  std::array<float, 2> shown{static_cast<float>(angles.azimuth_deg),
                             static_cast<float>(angles.elevation_deg)};
  const float half = (ImGui::CalcItemWidth() - ImGui::GetStyle().ItemInnerSpacing.x) * 0.5f;
  ImGui::SetNextItemWidth(half);
  bool is_moved = ImGui::SliderFloat("##azimuth", &shown[0], -kMaxAzimuthDeg, kMaxAzimuthDeg, "%.0f° round",
                                     ImGuiSliderFlags_AlwaysClamp);
  ImGui::SameLine(0.0f, ImGui::GetStyle().ItemInnerSpacing.x);
  ImGui::SetNextItemWidth(half);
  is_moved |= ImGui::SliderFloat("##elevation", &shown[1], -kMaxElevationDeg, kMaxElevationDeg, "%.0f° up",
                                 ImGuiSliderFlags_AlwaysClamp);
  if (!is_moved) return std::nullopt;
  return direction_of({shown[0], shown[1]}, glm::length(direction));
}

std::optional<FormValue> draw_choice(const FormField& field) {
  const auto& present = std::get<std::string>(field.value);
  std::optional<FormValue> chosen;
  if (!ImGui::BeginCombo("##value", present.c_str())) return chosen;
  for (const std::string& name : field.choices)
    if (ImGui::Selectable(name.c_str(), name == present)) chosen = name;
  ImGui::EndCombo();
  return chosen;
}

/// Draws a slider over the field's choices. A value that is none of them puts the handle in the middle.
std::optional<FormValue> draw_stops(const FormField& field) {
  const auto& present = std::get<std::string>(field.value);
  const auto found = std::find(field.choices.begin(), field.choices.end(), present);
  const int count = static_cast<int>(field.choices.size());
  int stop = found != field.choices.end() ? static_cast<int>(found - field.choices.begin()) : count / 2;
  const std::string shown = present.find('%') == std::string::npos ? present : std::string();
  if (!ImGui::SliderInt("##value", &stop, 0, count - 1, shown.c_str(), ImGuiSliderFlags_NoInput))
    return std::nullopt;
  return field.choices[static_cast<size_t>(std::clamp(stop, 0, count - 1))];
}

constexpr size_t kMaxTextBytes = 256;

/// The text as it stands when the person leaves the box or hits Enter.
std::optional<std::string> text_box(const char* label, const std::string& present) {
  std::array<char, kMaxTextBytes> text{};
  present.copy(text.data(), text.size() - 1);
  ImGui::InputText(label, text.data(), text.size());
  if (!ImGui::IsItemDeactivatedAfterEdit()) return std::nullopt;
  return std::string(text.data());
}

std::optional<FormValue> draw_widget(const FormField& field) {
  switch (field.widget) {
    case FormWidget::Slider:
      if (const auto moved = slider(field, std::get<double>(field.value))) return *moved;
      return std::nullopt;
    case FormWidget::Whole:
      return draw_whole(field);
    case FormWidget::Color:
      return draw_color(field);
    case FormWidget::Direction:
      return draw_direction(field);
    case FormWidget::Choice:
      return draw_choice(field);
    case FormWidget::Stops:
      return draw_stops(field);
    case FormWidget::Text:
      if (const auto text = text_box("##value", std::get<std::string>(field.value))) return *text;
      return std::nullopt;
  }
  return std::nullopt;
}

void draw_field(const FormField& field, float width, FormActions& actions) {
  ImGui::PushID(field.path.c_str());
  ImGui::BeginDisabled(field.is_idle);
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(field.title.c_str());
  if (!field.help.empty() && ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled))
    ImGui::SetTooltip("%s", field.help.c_str());
  if (field.usual && ImGui::IsItemHovered() && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left))
    actions.edits.push_back({field.path, *field.usual});
  ImGui::SameLine(width * kTitleShare);
  ImGui::SetNextItemWidth(-1.0f);
  if (auto value = draw_widget(field)) actions.edits.push_back({field.path, std::move(*value)});
  ImGui::EndDisabled();
  ImGui::PopID();
}

void draw_note(const ImVec4& color, const std::string& words) {
  if (words.empty()) return;
  ImGui::PushStyleColor(ImGuiCol_Text, color);
  ImGui::TextWrapped("%s", words.c_str());
  ImGui::PopStyleColor();
}

void draw_saving(const FormState& form, FormActions& actions) {
  ImGui::Separator();
  ImGui::SetNextItemWidth(-1.0f);
  if (auto file = text_box("##file", form.file)) actions.file = std::move(file);
  if (ImGui::Button("Save as scene")) actions.wants_save = true;
  if (!form.undo.empty()) {
    ImGui::SameLine();
    if (ImGui::Button(form.undo.c_str())) actions.wants_undo = true;
  }
  draw_note(kFormLabelColor, form.save_note);
  if (!form.share.empty() && ImGui::Button(form.share.c_str())) actions.wants_share = true;
}

/// Those on top, whether there are any.
bool draw_top(const FormState& form, float width, FormActions& actions) {
  bool has_any = false;
  for (const FormField& field : form.fields) {
    if (!field.section.empty()) continue;
    has_any = true;
    draw_field(field, width, actions);
  }
  draw_note(kFormLabelColor, form.top_note);
  return has_any;
}

/// Sections in the order in which their first fields come; the first is open.
void draw_sections(const FormState& form, float width, FormActions& actions) {
  std::vector<std::string> sections;
  for (const FormField& field : form.fields)
    if (!field.section.empty() &&
        std::find(sections.begin(), sections.end(), field.section) == sections.end())
      sections.push_back(field.section);
  for (const std::string& section : sections) {
    ImGui::SetNextItemOpen(section == sections.front(), ImGuiCond_Once);
    if (!ImGui::CollapsingHeader(section.c_str())) continue;
    for (const FormField& field : form.fields)
      if (field.section == section) draw_field(field, width, actions);
  }
}

}  // namespace

void FormActions::add(FormActions later) {
  edits.insert(edits.end(), std::make_move_iterator(later.edits.begin()),
               std::make_move_iterator(later.edits.end()));
  if (later.file) file = std::move(later.file);
  wants_save = wants_save || later.wants_save;
  wants_undo = wants_undo || later.wants_undo;
  wants_share = wants_share || later.wants_share;
}

DirectionAngles angles_of(const glm::vec3& direction) {
  const glm::dvec3 from = -glm::normalize(glm::dvec3(direction));
  return {std::atan2(from.x, from.z) * kDegPerRad, std::asin(std::clamp(from.y, -1.0, 1.0)) * kDegPerRad};
}

glm::vec3 direction_of(const DirectionAngles& angles, float length) {
  const double azimuth = angles.azimuth_deg / kDegPerRad;
  const double elevation = angles.elevation_deg / kDegPerRad;
  const glm::dvec3 from(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                        std::cos(elevation) * std::cos(azimuth));
  return glm::vec3(-from * static_cast<double>(length));
}

float to_srgb(float linear) {
  if (linear <= kLinearEnd) return kLinearSlope * linear;
  return (1.0f + kOffset) * std::pow(linear, 1.0f / kGamma) - kOffset;
}

float from_srgb(float shown) {
  if (shown <= kShownEnd) return shown / kLinearSlope;
  return std::pow((shown + kOffset) / (1.0f + kOffset), kGamma);
}

PanelSize draw_form_panel(const FormState& form, FormActions& actions) {
  const ImVec2 area = ImGui::GetIO().DisplaySize;
  const float letter = ImGui::GetFontSize();
  const float margin = kFormMarginLetters * letter;
  const float width = std::min(kFormLetters * letter, area.x - 2.0f * margin);
  const float most_height = area.y - 2.0f * margin;
  if (width <= 0.0f || most_height <= 0.0f) return {};
  ImGui::SetNextWindowPos({area.x - margin, margin}, ImGuiCond_Always, {1.0f, 0.0f});
  ImGui::SetNextWindowSizeConstraints({width, 0.0f}, {width, most_height});
  ImGui::SetNextWindowBgAlpha(kFormAlpha);
  PanelSize size;
  if (ImGui::Begin("form", nullptr, kFormFlags | ImGuiWindowFlags_AlwaysAutoResize)) {
    if (!draw_top(form, width, actions) || ImGui::CollapsingHeader("More")) {
      draw_note(kTitleColor, form.title);
      for (const std::string& note : form.notes) draw_note(kNoteColor, note);
      draw_sections(form, width, actions);
      draw_saving(form, actions);
    }
    size = {ImGui::GetWindowWidth(), ImGui::GetWindowHeight()};
  }
  ImGui::End();
  return size;
}

}  // namespace strandcast
