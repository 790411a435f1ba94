// Lines and words of a text file, with the line number for every complaint.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace limber::meshing::detail {

// The value of a number as programs write it: 1, +1.5, -2e3, 1., nan, inf, 1.#QNAN; false when it is none.
bool parse_number(std::string_view word, double& value);
bool parse_integer(std::string_view word, std::int64_t& value);

class TextScanner {
 public:
  // `comment` starts a comment that ends with the line; 0: there are none. Both must outlive the scanner.
  TextScanner(std::string_view text, std::string_view file, char comment);

  bool next_line();              // to the next line that holds a word; false at the end of the text
  std::string_view next_word();  // of this line; empty at its end
  double next_number(const char* what);
  std::int64_t next_integer(const char* what);

  // Throws InputError: "file:line: what"; at a last line without its end it adds that the file looks cut
  // short.
  [[noreturn]] void complain(const std::string& what) const;
  int line() const { return line_number_; }

 private:
  std::string_view text_, rest_of_line_;
  std::string_view file_;
  std::size_t next_ = 0;
  int line_number_ = 0;
  char comment_;
};

}  // namespace limber::meshing::detail
