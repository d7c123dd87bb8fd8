"""Completion for bash: click's own script offers words or files, never both, and takes `NAME=VALUE` for three words.

Ours hands over the line as it was typed, leaves out what bash keeps before a `=` or `:`, and lets bash complete files where we
know no words.
"""

import os
from typing import Final

from click.shell_completion import BashComplete, add_completion_class, split_arg_string

_SCRIPT: Final = r"""%(complete_func)s() {
    local line=${COMP_LINE:0:COMP_POINT} kind value
    local current=${line##*[[:space:]]}
    local kept=${current%%"${current##*[=:]}"}
    COMPREPLY=()
    while IFS=, read -r kind value; do
        case $kind in
            plain)
                COMPREPLY+=("${value#"$kept"}")
                [[ $value == *= ]] && compopt -o nospace
                ;;
            file | dir)
                compopt -o filenames
                [[ $kind == dir ]] && local action=-d || local action=-f
                while IFS= read -r value; do COMPREPLY+=("$value"); done < <(compgen $action -- "${current#"$kept"}")
                ;;
        esac
    done < <(COMP_LINE="$line" %(complete_var)s=bash_complete "$1" 2>/dev/null)
    return 0
}
complete -o nosort -o bashdefault -o default -F %(complete_func)s %(prog_name)s
"""


class BashCompletion(BashComplete):
    """What bash is told, and what it tells us: the line up to the cursor."""

    source_template = _SCRIPT

    def source(self) -> str:
        """Return the script."""
        return self.source_template % self.source_vars()

    def get_completion_args(self) -> tuple[list[str], str]:
        """Return the words before the one that is being typed, and that one, which may be empty."""
        line = os.environ.get("COMP_LINE", "")
        words = split_arg_string(line)[1:]
        incomplete = words.pop() if words and not line[-1:].isspace() else ""
        return words, incomplete


def use_our_bash() -> None:
    """Have click answer bash by this script's rules."""
    add_completion_class(BashCompletion, "bash")
