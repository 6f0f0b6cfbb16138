# Puts the first file's table in the place of the second file's, between the marks.
FNR == NR { table = table $0 "\n"; next }
/^<!-- matrix: end -->/ { inside = 0 }
!inside { print }
/^<!-- matrix: begin -->/ { inside = 1; printf "%s", table }
