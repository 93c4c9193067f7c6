#include "client/window/hud_panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <array>
#include <utility>

namespace strandcast {
namespace {

constexpr float kMargin = 10.0f;
constexpr float kPanelAlpha = 0.55f;
constexpr float kLabelColumn = 130.0f;
const ImVec4 kWarningColor(1.0f, 0.75f, 0.3f, 1.0f);

constexpr ImGuiWindowFlags kPanelFlags =
    ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings |
    ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav | ImGuiWindowFlags_NoInputs;

void row(const char* label, const std::string& value) {
  ImGui::TextUnformatted(label);
  ImGui::SameLine(kLabelColumn);
  ImGui::TextUnformatted(value.c_str());
}

void warning(const char* text) {
  ImGui::TextColored(kWarningColor, "%s", text);
}

}  // namespace

void draw_hud_panel(const HudState& hud) {
  ImGui::SetNextWindowPos(ImVec2(kMargin, kMargin));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  if (ImGui::Begin("measurements", nullptr, kPanelFlags)) {
    ImGui::TextUnformatted(hud.title.c_str());
    ImGui::TextUnformatted(hud.connection.c_str());
    ImGui::Separator();
    row("shows", hud.mode);
    row("asked for", hud.mode_wish);
    if (!hud.mode_reason.empty()) row("because", hud.mode_reason);
    row("picture", fmt::format("{:.0f} fps, {:.1f} ms", hud.fps, hud.render_ms));
    row("server step", fmt::format("{:.2f} ms, x{:.2f} real time", hud.sim_ms, hud.realtime_factor));
    row("stream", fmt::format("{:.1f} kB/s, {:.0f} frames/s", hud.kilobytes_per_s, hud.frames_per_s));
    row("state age", fmt::format("{:.1f} ms", hud.state_age_ms));
    if (hud.motion_to_decoded_ms > 0.0)
      row("motion to photon",
          fmt::format(
              "{:.1f} ms decoded + {:.1f} ms draw{}", hud.motion_to_decoded_ms, hud.render_ms,
              hud.playout_delay_ms > 0.0 ? fmt::format(" + {:.1f} ms smooth", hud.playout_delay_ms) : ""));
    row("encode, decode", fmt::format("{:.2f} ms, {:.2f} ms", hud.encode_ms, hud.decode_ms));
    row("round trip", fmt::format("{:.2f} ms, {:.0f} ms queued", hud.round_trip_ms, hud.queue_delay_ms));
    row("dropped", fmt::format("{} server, {} missed, {} here", hud.dropped_by_server, hud.missed_frames,
                               hud.dropped_by_client));
    row("tick", fmt::format("{}, {} viewer{}", hud.tick, hud.viewer_count, hud.viewer_count == 1 ? "" : "s"));
    if (hud.is_paused) warning("paused (Space resumes, N steps)");
    if (hud.is_motion_stale) warning("no head motion arrives at the server");
    if (!hud.message.empty()) warning(hud.message.c_str());
    ImGui::TextDisabled("H: help");
  }
  ImGui::End();
}

void draw_help_panel() {
  static constexpr std::array<std::pair<const char*, const char*>, 12> kHelp{{
      {"left drag", "turn about the head"},
      {"middle, right drag", "move the view"},
      {"wheel", "closer, farther"},
      {"R", "back to the first view"},
      {"Space", "pause or resume the server"},
      {"N", "one simulation step"},
      {"P", "newest state or smooth playout"},
      {"M", "auto, strands drawn here, or the server's pictures"},
      {"S", "save a picture"},
      {"U", "hide or show the measurements"},
      {"H, F1", "hide or show this help"},
      {"Esc, Q", "quit"},
  }};
  constexpr float kKeyColumn = 160.0f;
  const ImVec2 area = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos(ImVec2(area.x - kMargin, area.y - kMargin), ImGuiCond_Always, ImVec2(1.0f, 1.0f));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  if (ImGui::Begin("help", nullptr, kPanelFlags)) {
    for (const auto& [key, meaning] : kHelp) {
      ImGui::TextUnformatted(key);
      ImGui::SameLine(kKeyColumn);
      ImGui::TextUnformatted(meaning);
    }
  }
  ImGui::End();
}

void draw_connection_banner(const HudState& hud) {
  const ImVec2 area = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos(ImVec2(area.x * 0.5f, area.y * 0.5f), ImGuiCond_Always, ImVec2(0.5f, 0.5f));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  if (ImGui::Begin("connection", nullptr, kPanelFlags)) warning(hud.connection.c_str());
  ImGui::End();
}

}  // namespace strandcast
