def sweep_html(found): return ""
