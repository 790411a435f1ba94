#include "limber/detail/report/page.h"

#include "core/version.h"

namespace limber::detail {

// The files beside this one, made part of the library by cmake/limber_embed.cmake.
extern const char* const report_css;

std::string escaped(const std::string& text) {
  std::string html;
  for (const char c : text)
    html += c == '&'   ? "&amp;"
            : c == '<' ? "&lt;"
            : c == '>' ? "&gt;"
            : c == '"' ? "&quot;"
                       : std::string(1, c);
  return html;
}

std::string base64(std::string_view bytes) {
  constexpr const char* letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? std::uint8_t(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k <= bytes.size() ? letters[three >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string inlined(const std::string& svg) { return svg.substr(svg.find("<svg")); }

void Page::begin(const std::string& heading, const std::string& title, const std::string& lead) {
  // Nothing may be fetched from anywhere, says the page itself.
  add("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
      "script-src 'unsafe-inline'; img-src data:; media-src data:\">\n"
      "<meta name=\"generator\" content=\"limber {}\">\n<link rel=\"icon\" "
      "href=\"data:,\">\n<title>{}</title>\n<style>\n",
      version, escaped(title));
  add_text(report_css);
  add("</style>\n</head>\n<body>\n<main>\n<h1>{}</h1>\n<p class=\"lead\">{}</p>\n", escaped(heading),
      escaped(lead));
}

void Page::table(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows) {
  std::vector<const char*> classes(head.size(), "");
  for (std::size_t c = 0; c < head.size() && !rows.empty(); ++c)
    if (!rows[0][c].empty() && std::string("0123456789-−").find(rows[0][c][0]) != std::string::npos)
      classes[c] = " class=\"number\"";
  add("<div class=\"card wide\"><table>\n<tr>");
  for (std::size_t c = 0; c < head.size(); ++c) add("<th{}>{}</th>", classes[c], escaped(head[c]));
  add("</tr>\n");
  for (const std::vector<std::string>& row : rows) {
    add("<tr>");
    for (std::size_t c = 0; c < row.size(); ++c) add("<td{}>{}</td>", classes[c], escaped(row[c]));
    add("</tr>\n");
  }
  add("</table></div>\n");
}

}  // namespace limber::detail
