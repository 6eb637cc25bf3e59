# `python` and `python3` of a program are the interpreter that has ROS, whatever else is on the path.
_cellwright_bin="@CELLWRIGHT_BIN@"
case ":$PATH:" in
  *":$_cellwright_bin:"*) ;;
  *) [ ! -d "$_cellwright_bin" ] || export PATH="$_cellwright_bin:$PATH" ;;
esac
unset _cellwright_bin
