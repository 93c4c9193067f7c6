// Byte layouts of an asset (proto/WIRE.md). encode_scene_asset() writes the newest one. Pure functions, any
// thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/strands/scene_asset.h"

namespace strandcast {

/// Floats under zstd, whole numbers that are predicted, or these with the built-in head by its form; their
/// numbers are those on the wire.
enum class AssetLayout : uint32_t { Floats = 1, Numbers = 2, Form = 3 };
inline constexpr AssetLayout kNewestAssetLayout = AssetLayout::Form;
/// Returns what this program says that it takes: no forms where it has made another head of one.
AssetLayout newest_asset_layout();

/// Serialises the payload of an Asset message for a viewer that knows layouts up to `newest`. Every layout
/// gives back the same bits. What is not rounded as by load_scene_content() has Floats in any case, and other
/// heads than the built-in one have Numbers at most.
std::vector<std::byte> encode_scene_asset(const SceneAsset& asset, AssetLayout newest);

}  // namespace strandcast
