// DebugView: what a renderer shows instead of hair, for who wants to see how a picture comes about. A choice
// of the moment, not of the scene. Any thread.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace strandcast {

enum class DebugView : uint8_t {
  None,
  Tangents,  // of strands in head space: red x, green y, blue z, 0.5 for none
  Density,   // of hair, in a plane through the point looked at: white is dense
  Shadow,    // how much of the key light reaches a strand
  Overdraw,  // layers of strands over a pixel: kOverdrawLayers of them leave 37 % of it black
  Tiles,     // squares that are drawn by themselves: the more segments, the redder
};
inline constexpr std::array kDebugViews = {DebugView::None,   DebugView::Tangents, DebugView::Density,
                                           DebugView::Shadow, DebugView::Overdraw, DebugView::Tiles};
inline constexpr float kOverdrawLayers = 32.0f;
/// Linear light of what is white: the tone curve leaves it as it is (shaders/lib/tone.glsl).
inline constexpr float kDebugWhite = 0.7f;

/// "none", "tangents", "density", "shadow", "overdraw", "tiles".
constexpr std::string_view name_of(DebugView view) {
  constexpr std::array<std::string_view, kDebugViews.size()> kNames = {"none",   "tangents", "density",
                                                                       "shadow", "overdraw", "tiles"};
  return kNames[static_cast<size_t>(view)];
}
/// None for an unknown name.
constexpr DebugView debug_view_named(std::string_view name) {
  for (const DebugView view : kDebugViews)
    if (name_of(view) == name) return view;
  return DebugView::None;
}
/// Each in turn, and again.
constexpr DebugView next_of(DebugView view) {
  return kDebugViews[(static_cast<size_t>(view) + 1) % kDebugViews.size()];
}

}  // namespace strandcast
