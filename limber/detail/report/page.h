// The pages in HTML that limber writes: one file, which fetches nothing.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <vector>

namespace limber::detail {

std::string escaped(const std::string& text);

std::string base64(std::string_view bytes);

// An SVG document within a page: the declaration that begins it goes.
std::string inlined(const std::string& svg);

class Page {
 public:
  // Up to the heading and the sentence below it.
  void begin(const std::string& heading, const std::string& title, const std::string& lead);
  template <class... Arguments>
  void add(fmt::format_string<Arguments...> form, Arguments&&... arguments) {
    fmt::format_to(std::back_inserter(html_), form, std::forward<Arguments>(arguments)...);
  }
  void add_text(std::string_view text) { html_ += text; }

  // Head, then rows; of a cell that begins with a digit or a sign the whole column is of numbers.
  void table(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows);
  const std::string& html() const { return html_; }

 private:
  std::string html_;
};

}  // namespace limber::detail
