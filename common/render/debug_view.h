// DebugView: what a renderer shows instead of hair to explain how a picture is made. It is a choice of the
// moment, not part of the scene. Any thread.
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
/// Linear light that represents white; the tone curve leaves it unchanged (shaders/lib/tone.glsl).
inline constexpr float kDebugWhite = 0.7f;

/// Returns "none", "tangents", "density", "shadow", "overdraw" or "tiles".
constexpr std::string_view name_of(DebugView view) {
  constexpr std::array<std::string_view, kDebugViews.size()> kNames = {"none",   "tangents", "density",
                                                                       "shadow", "overdraw", "tiles"};
  return kNames[static_cast<size_t>(view)];
}
/// Returns the view of a name; None for an unknown one.
constexpr DebugView debug_view_named(std::string_view name) {
  for (const DebugView view : kDebugViews)
    if (name_of(view) == name) return view;
  return DebugView::None;
}
/// Returns the next view, cyclically.
constexpr DebugView next_of(DebugView view) {
  return kDebugViews[(static_cast<size_t>(view) + 1) % kDebugViews.size()];
}

}  // namespace strandcast
