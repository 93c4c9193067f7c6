// How a request for a file of the page is answered. Pure functions on untrusted text, any thread; nothing
// here sends.
#pragma once

#include <string>
#include <string_view>

#include "common/page/page_files.h"

namespace strandcast {

/// Returns a request's target up to '?'; the query may hold anything and must not be logged.
std::string_view path_of_target(std::string_view target);

/// Returns the file at this path; nullptr if there is none.
const PageFile* find_page_file(PageFiles files, std::string_view path);

enum class PageCoding { Plain, Gzip, Brotli };
/// Returns HTTP's name of a coding: "plain", "gzip", "br".
std::string_view name_of(PageCoding coding);
std::string_view content_of(const PageFile& file, PageCoding coding);

/// Returns the smallest coding that an Accept-Encoding field permits: Brotli if named, gzip if it or
/// everything is named, otherwise plain.
PageCoding best_coding(std::string_view accept_encoding);

/// Returns whether an If-None-Match field names this entity tag (weak comparison, RFC 9110, 13.1.2) or any.
bool names_tag(std::string_view if_none_match, std::string_view tag);

/// Returns the Content-Security-Policy for a file requested with this (allowed) Host: own scripts, styles and
/// connections, and pictures made by scripts; nothing else.
std::string page_policy(std::string_view host);

}  // namespace strandcast
