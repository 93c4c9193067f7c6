// The part of the streaming report's page about what viewers see: tables, a plot and CSV files. Any thread.
#pragma once

#include <string>

#include "server/report/html_page.h"
#include "server/report/stream_playout.h"
#include "server/report/stream_view.h"

namespace strandcast {

/// Returns PSNR and SSIM of every bound and distance.
HtmlTable view_table(const StreamView& view);
std::string view_plot(const StreamView& view);
/// Returns the Mbit/s of pictures that look as good as strands, beside those of the strands.
HtmlTable pixel_table(const StreamView& view, LookMeasure measure);
/// Returns a plot of PSNR against Mbit/s of strands and of every picture codec at one distance.
std::string pixel_plot(const StreamView& view, double distance_m);

/// Adds both sections with their pictures.
void add_view_sections(HtmlPage& page, const StreamView& view);

/// Returns the errors of interpolation at 30 Hz; empty without rows.
HtmlTable playout_table(const std::vector<PlayoutRow>& rows);
void add_playout_section(HtmlPage& page, const std::vector<PlayoutRow>& rows, const std::string& note);
std::string playout_csv(const std::vector<PlayoutRow>& rows);

std::string view_csv(const StreamView& view);
std::string pixel_csv(const StreamView& view);

}  // namespace strandcast
